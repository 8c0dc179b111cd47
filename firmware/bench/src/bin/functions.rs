//! Counted functions: each prints a line `name elements hash`, in the order of the counted regions.
//! `host-tests/tests/all/on_target/functions.rs` computes the same on the host.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_bench::main;

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::fmt::Write as _;

    use actq_firmware_bench::functions::{LEN, each};
    use actq_firmware_support::host;
    use actq_firmware_support::machine::entry;

    #[entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let mut out = host::stdout()?;
        each(|name, hash| writeln!(out, "{name} {LEN} {hash:08x}").ok())
    }
}
