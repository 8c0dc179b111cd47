//! The whole runtime with whole steps, and nothing else (no host, no text). `cargo xtask budgets` measures its code; it
//! is not run.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    use actq_kernels::{Head, Image};

    actq_firmware_bench::measured!(run);

    /// Makes all calls of an application that does not split its steps.
    fn run(image: &[u8], scratch: &mut [u32], observation: &[f32]) -> Option<f32> {
        let mut head = Head::new(Image::new_checked(image).ok()?, scratch).ok()?;
        head.self_test().ok()?;
        head.reset();
        head.infer(observation).ok()?.first()?;
        head.step(observation).ok()?.first().copied()
    }
}
