//! The whole runtime as `runtime.rs` has it, and steps in pieces, which bring the cost model with them:
//! `cargo xtask budgets` measures its code. It is not run.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    use core::hint::black_box;
    use core::task::Poll;

    use actq_kernels::{Head, Image};

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut scratch = [0u32; 256];
        loop {
            // What the compiler cannot see through stays in the code.
            black_box(run(black_box(&[]), black_box(&mut scratch), black_box(&[])));
        }
    }

    /// All that an application calls that does.
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
