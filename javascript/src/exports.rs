//! The functions that the module exports. `actq.js` is their only caller.
//!
//! An instance of the module has one head. The caller writes an image to the address that [`allocate`] returns, and
//! calls [`open`]; then, for each step, it writes an observation to the address that [`observation`] returns, calls
//! [`step`], and reads the action at the address that [`action`] returns. Functions with a status return 0, or 1 after
//! an error, whose message [`text`] gives.
#![allow(unsafe_code, reason = "exported names; there is no unsafe block")]

use std::cell::RefCell;
use std::fmt::Display;

use actq_kernels::{Head, Image};

use crate::products::Products;

/// A head with its buffers.
struct Running {
    head: Head<'static, 'static>,
    observation: Vec<f32>,
    action: Vec<f32>,
    products: Option<Products<'static>>,
}

thread_local! {
    /// Words that the caller has written, until [`open`] or [`weights`] takes them.
    static INPUT: RefCell<Vec<u32>> = const { RefCell::new(Vec::new()) };
    static RUNNING: RefCell<Option<Running>> = const { RefCell::new(None) };
    static TEXT: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Returns the address of a new buffer of this many bytes, rounded up to whole words of 0.
#[unsafe(no_mangle)]
pub extern "C" fn allocate(bytes: usize) -> *mut u32 {
    INPUT.with_borrow_mut(|input| {
        *input = vec![0; bytes.div_ceil(4)];
        input.as_mut_ptr()
    })
}

/// Opens the image of `bytes` bytes in the buffer. Its memory lives as long as the instance.
#[unsafe(no_mangle)]
pub extern "C" fn open(bytes: usize) -> u32 {
    let words: &'static [u32] = INPUT.take().leak();
    let open = || {
        let bytes = bytemuck::cast_slice(words).get(..bytes).ok_or_else(|| "the image was not copied".to_owned())?;
        let image = Image::new_checked(bytes).map_err(|error| error.to_string())?;
        let scratch = vec![0; image.scratch_words()].leak();
        let head = Head::new(image, scratch).map_err(|error| error.to_string())?;
        let [observation, action] = [image.obs_len(), image.act_len()].map(|len| vec![0.0; len]);
        RUNNING.set(Some(Running { head, observation, action, products: None }));
        Ok::<_, String>(())
    };
    status(open())
}

/// Takes the buffer's f32 values as the weights of the image's matrices: each matrix once, in the order of the
/// operations that first use them, row by row. The head computes with them from now on, with activations in f32.
#[unsafe(no_mangle)]
pub extern "C" fn weights() -> u32 {
    let words = INPUT.take();
    status(running(|running| {
        running.products = Some(Products::new(running.head.image(), bytemuck::cast_slice(&words))?);
        Ok(())
    }))
}

/// Returns the address of the observation.
#[unsafe(no_mangle)]
pub extern "C" fn observation() -> *mut f32 {
    RUNNING.with_borrow_mut(|running| running.as_mut().map_or(std::ptr::null_mut(), |r| r.observation.as_mut_ptr()))
}

/// Returns the address of the action.
#[unsafe(no_mangle)]
pub extern "C" fn action() -> *const f32 {
    RUNNING.with_borrow(|running| running.as_ref().map_or(std::ptr::null(), |r| r.action.as_ptr()))
}

/// Computes the action of the observation, as [`Head::step`] does.
#[unsafe(no_mangle)]
pub extern "C" fn step() -> u32 {
    status(running(|Running { head, observation, action, products }| {
        let result = match products {
            Some(products) => products.step(head, observation),
            None => head.step(observation),
        };
        action.copy_from_slice(result.map_err(|error| error.to_string())?);
        Ok(())
    }))
}

/// Clears the recurrent state, histories, chunks and the last action.
#[unsafe(no_mangle)]
pub extern "C" fn reset() -> u32 {
    status(running(|running| {
        running.head.reset();
        Ok(())
    }))
}

/// Sets the seed of the noise, and resets.
#[unsafe(no_mangle)]
pub extern "C" fn seed(seed: u32) -> u32 {
    status(running(|running| {
        running.head.seed(seed);
        Ok(())
    }))
}

/// Writes the state of the head to the address that [`allocate`] returned for it: as many bytes as [`number`] 5.
#[unsafe(no_mangle)]
pub extern "C" fn save() -> u32 {
    let save = |running: &mut Running| {
        INPUT.with_borrow_mut(|to| running.head.save(bytemuck::cast_slice_mut(to))).map_err(|error| error.to_string())
    };
    status(running(save))
}

/// Takes the buffer as a state that [`save`] wrote for a head of the same image.
#[unsafe(no_mangle)]
pub extern "C" fn restore() -> u32 {
    let from = INPUT.take();
    let restore =
        |running: &mut Running| running.head.restore(bytemuck::cast_slice(&from)).map_err(|error| error.to_string());
    status(running(restore))
}

/// Returns a number of the image: 0 the observation's length, 1 the action's, 2 the control rate in Hz, 3 the bytes of
/// its scratch memory, 4 its CRC-32, 5 the bytes of a head's state.
#[unsafe(no_mangle)]
pub extern "C" fn number(which: u32) -> f64 {
    let number = |head: &Head<'_, '_>| match which {
        0 => head.image().obs_len() as f64,
        1 => head.image().act_len() as f64,
        2 => f64::from(head.image().rate_hz()),
        3 => 4.0 * head.image().scratch_words() as f64,
        4 => f64::from(head.image().crc()),
        5 => head.saved_len() as f64,
        _ => f64::NAN,
    };
    RUNNING.with_borrow(|running| running.as_ref().map_or(f64::NAN, |running| number(&running.head)))
}

/// Prepares a text and returns its bytes of UTF-8, at the address that [`text_address`] returns: 0 the last error, 1 the
/// image's name, 2 its raw inputs and targets.
///
/// A raw input or target is a line of fields between tabs: its kind, length, lowest and highest value, name, and the
/// names of its values. Names have no control characters.
#[unsafe(no_mangle)]
pub extern "C" fn text(which: u32) -> usize {
    let of_image = |image: &Image<'_>| match which {
        1 => image.name().to_owned(),
        _ => image.ports().map(|port| line(&port) + "\n").collect(),
    };
    TEXT.with_borrow_mut(|text| {
        if which != 0 {
            *text =
                RUNNING.with_borrow(|running| running.as_ref().map(|r| of_image(r.head.image()))).unwrap_or_default();
        }
        text.len()
    })
}

/// Returns the address of the text that [`text`] prepared.
#[unsafe(no_mangle)]
pub extern "C" fn text_address() -> *const u8 {
    TEXT.with_borrow(|text| text.as_ptr())
}

fn line(port: &actq_kernels::Port<'_>) -> String {
    let [low, high] = port.range;
    let start = format!("{:?}\t{}\t{low}\t{high}\t{}", port.kind, port.len, port.name);
    port.names.lines().fold(start, |line, name| line + "\t" + name)
}

/// Runs `work` with the head.
fn running(work: impl FnOnce(&mut Running) -> Result<(), String>) -> Result<(), String> {
    RUNNING.with_borrow_mut(|running| work(running.as_mut().ok_or("no image is open")?))
}

/// Returns the status of a result, and keeps the message of its error.
fn status(result: Result<(), impl Display>) -> u32 {
    match result {
        Ok(()) => 0,
        Err(error) => {
            TEXT.set(error.to_string());
            1
        }
    }
}
