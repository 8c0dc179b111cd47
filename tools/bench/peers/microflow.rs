//! The network that microflow's macro makes of a TensorFlow Lite file.
#![no_std]

use microflow::buffer::Buffer2D;
use microflow_macros::model;

#[model("@MODEL@")]
struct Network;

unsafe extern "C" {
    static peer_input: *const i8;
}

static mut OUTPUT: [f32; @OUTPUTS@] = [0.0; @OUTPUTS@];

#[unsafe(no_mangle)]
extern "C" fn peer_init() {}

#[unsafe(no_mangle)]
extern "C" fn peer_step(step: u32) {
    // SAFETY: data.c has the array, and nothing else runs.
    unsafe {
        let input = core::slice::from_raw_parts(peer_input.add(step as usize * @INPUTS@), @INPUTS@);
        let output = Network::predict_quantized(Buffer2D::<i8, 1, @INPUTS@>::from_fn(|_, i| input[i]));
        for i in 0..@OUTPUTS@ {
            (*(&raw mut OUTPUT))[i] = output[i];
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn peer_output(index: u32) -> u32 {
    // SAFETY: nothing else runs.
    unsafe { (*(&raw const OUTPUT))[index as usize].to_bits() }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
