//! Raw inputs and targets by the C interface, of an image with every operation around its network.

use std::ffi::CString;
use std::mem::MaybeUninit;

use actq::runtime::ImageBuffer;
use actq_c::{ActqImage, CPort, Code, Text, actq_image_open, actq_image_port, actq_image_sizes, actq_set_input};
use actq_kernels::PortKind;
use anyhow::Result;

use crate::deployed::Made;

/// Returns a text of the interface.
///
/// # Safety
///
/// The image's bytes are as they were.
unsafe fn text<'a>(text: Text) -> &'a [u8] {
    // SAFETY: the interface gives valid texts of the image.
    unsafe { std::slice::from_raw_parts(text.data.cast(), text.len) }
}

#[test]
fn inputs_and_ports_follow_the_image() -> Result<()> {
    let bytes = Made::deployment()?.1.four_bits()?;
    let buffer = ImageBuffer::new(&bytes);
    let expected = buffer.image("made".as_ref())?;
    let aligned: Vec<u32> = bytes.chunks_exact(4).map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]])).collect();
    let mut image = Box::new(MaybeUninit::<ActqImage>::uninit());
    let image = image.as_mut_ptr();
    let len = expected.obs_len();
    let mut observation = vec![-1.0f32; len];
    let mut wanted = observation.clone();
    let mut offsets = [0; 2];
    // SAFETY: the pointers are valid for their lengths, and the texts are the image's.
    unsafe {
        assert_eq!(actq_image_open(image, aligned.as_ptr().cast(), bytes.len()), Code::Ok as i32);
        let set = |name: &str, values: &[f32], observation: &mut [f32]| {
            let name = CString::new(name).expect("a name");
            let (to, len) = (observation.as_mut_ptr(), observation.len());
            actq_set_input(image, name.as_ptr(), values.as_ptr(), values.len(), to, len)
        };
        let mut ports = 0;
        for (number, known) in expected.ports().enumerate() {
            let mut port = MaybeUninit::<CPort>::uninit();
            assert_eq!(actq_image_port(image, number, port.as_mut_ptr()), Code::Ok as i32);
            let port = port.assume_init();
            let is_input = known.kind == PortKind::Input;
            let offset = &mut offsets[usize::from(!is_input)];
            assert_eq!((text(port.name), text(port.names)), (known.name.as_bytes(), known.names.as_bytes()));
            assert_eq!((port.kind, port.len, port.offset), (known.kind as u32, known.len, *offset));
            assert_eq!([port.low, port.high], known.range);
            let values: Vec<f32> = (0..known.len).map(|i| (10 * number + i) as f32).collect();
            let status = set(known.name, &values, &mut observation);
            if is_input {
                assert_eq!(status, Code::Ok as i32, "{}", known.name);
                wanted[*offset..][..known.len].copy_from_slice(&values);
                // Too few values, and an observation of another length.
                assert_eq!(set(known.name, &values[1..], &mut observation), Code::Length as i32);
                assert_eq!(set(known.name, &values, &mut wanted.clone()[1..]), Code::Length as i32);
            } else {
                assert_eq!(status, Code::NoSuchPort as i32, "a target is no input: {}", known.name);
            }
            *offset += known.len;
            ports = number + 1;
        }
        assert_eq!(observation, wanted);
        assert_eq!(offsets, [len, expected.act_len()]);
        let mut port = MaybeUninit::uninit();
        assert_eq!(actq_image_port(image, ports, port.as_mut_ptr()), Code::NoSuchPort as i32);
        let mut sizes = MaybeUninit::uninit();
        assert_eq!(actq_image_sizes(image, sizes.as_mut_ptr()), Code::Ok as i32);
        assert_eq!(sizes.assume_init().ports, ports);
        assert_eq!(set("no such input", &[1.0], &mut observation), Code::NoSuchPort as i32);
    }
    Ok(())
}
