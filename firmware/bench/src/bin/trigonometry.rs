//! Counted calls of a current loop's functions: each prints a line `name: hash`, in the order of the counted regions.
//! `host-tests/tests/all/on_target/foc.rs` computes the same hashes on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;
    use core::hint::black_box;

    use actq_firmware_bench::functions::hash;
    use actq_firmware_bench::trigonometry::{CASES, results};
    use actq_firmware_support::{count, host};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let mut out = host::stdout()?;
        for case in &CASES {
            let inputs = (case.inputs)();
            let case = black_box(case);
            let results = count::region(|| results(case, black_box(&inputs)));
            writeln!(out, "{}: {:08x}", case.name, hash(&[results.as_flattened()])).ok()?;
        }
        Some(())
    }
}
