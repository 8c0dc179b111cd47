//! embedded-nn's fully connected layers.
#![no_std]

use core::slice;

use embedded_nn::{Activation, Dims, FcParams, PerTensorQuantParams, fully_connected_s8};

/// `struct layer` of peer.h.
#[repr(C)]
struct Layer {
    rows: i32,
    cols: i32,
    weights: *const i8,
    bias: *const i32,
    multiplier: i32,
    shift: i32,
    zero_in: i32,
    zero_out: i32,
    least: i32,
}

unsafe extern "C" {
    static peer_layers: *const Layer;
    static peer_input: *const i8;
}

static mut VALUES: [[i8; @WIDEST@]; 2] = [[0; @WIDEST@]; 2];

#[unsafe(no_mangle)]
extern "C" fn peer_init() {}

#[unsafe(no_mangle)]
extern "C" fn peer_step(step: u32) {
    // SAFETY: data.c has these arrays, and nothing else runs.
    unsafe {
        let values = &mut *(&raw mut VALUES);
        let mut input = slice::from_raw_parts(peer_input.add(step as usize * @INPUTS@), @INPUTS@);
        for (i, layer) in slice::from_raw_parts(peer_layers, @LAYERS@).iter().enumerate() {
            let (rows, cols) = (layer.rows as usize, layer.cols as usize);
            let output = slice::from_raw_parts_mut(values[i % 2].as_mut_ptr(), rows);
            let params = FcParams {
                input_offset: -layer.zero_in,
                filter_offset: 0,
                output_offset: layer.zero_out,
                activation: Activation { min: layer.least, max: 127 },
            };
            let _ = fully_connected_s8(
                &params,
                &PerTensorQuantParams::new(layer.multiplier, layer.shift),
                &Dims::new(1, 1, 1, layer.cols),
                input,
                &Dims::new(layer.cols, 1, 1, layer.rows),
                slice::from_raw_parts(layer.weights, rows * cols),
                Some(slice::from_raw_parts(layer.bias, rows)),
                &Dims::new(1, 1, 1, layer.rows),
                output,
            );
            input = output;
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn peer_output(index: u32) -> i32 {
    // SAFETY: nothing else runs.
    unsafe { (*(&raw const VALUES))[(@LAYERS@ - 1) % 2][index as usize].into() }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
