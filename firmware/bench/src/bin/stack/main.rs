//! Measures the runtime's stack with the image in the slot: prints the bytes that the check of the image, the self-test
//! and a step use, including all functions that they call.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod depth;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;

    use actq_firmware_support::{host, slot};
    use actq_kernels::{Head, Image};
    use cortex_m::singleton;

    use crate::depth::depth;

    const SCRATCH: usize = 24 * 1024;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let bytes = slot::image()?;
        let (image, check) = depth(|| Image::new_checked(bytes));
        let image = image.ok()?;
        let scratch = singleton!(: [u32; SCRATCH] = [0; SCRATCH])?;
        let mut head = Head::new(image, scratch).ok()?;
        let (passed, self_test) = depth(|| head.self_test());
        passed.ok()?;
        let (observation, _) = image.self_test(0)?;
        let (stepped, step) = depth(|| head.step(bytemuck::cast_slice(observation)).map(|_| ()));
        stepped.ok()?;
        writeln!(host::stdout()?, "{check} {self_test} {step}").ok()
    }
}
