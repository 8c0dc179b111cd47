//! The whole runtime as in `runtime.rs`, plus steps in pieces, which include the cost model. `cargo xtask budgets`
//! measures its code; it is not run.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    use core::hint::black_box;
    use core::task::Poll;

    use actq_kernels::{Head, Image};

    actq_firmware_bench::measured!(run);

    /// Makes all calls of an application that splits its steps.
    fn run(image: &[u8], scratch: &mut [u32], observation: &[f32]) -> Option<f32> {
        let mut head = Head::new(Image::new_checked(image).ok()?, scratch).ok()?;
        head.self_test().ok()?;
        head.reset();
        head.infer(observation).ok()?.first()?;
        head.step(observation).ok()?.first()?;
        head.begin(observation).ok()?;
        loop {
            if let Poll::Ready(action) = head.poll(black_box(20_000)).ok()? {
                return action.first().copied();
            }
        }
    }
}
