//! The controller on a board, selected by a feature: a control tick at high priority, the head in slices below it, the
//! link over a serial port, a watchdog. `cargo xtask firmware` builds it.
//!
//! RTIC runs it on Cortex-M: tick and loop share values whose locks are hardware priorities, and all possible delays of
//! the tick are known at compile time. An async executor such as Embassy's suits programs that wait for many events; this
//! one waits for none. On RISC-V, where RTIC's software interrupts bring panics and a queue, the tasks are plain interrupts.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is firmware: `cargo xtask firmware` builds it");
    std::process::exit(1);
}

#[cfg(all(target_os = "none", target_arch = "arm"))]
mod app;
#[cfg(target_os = "none")]
mod faults;
#[cfg(all(target_os = "none", target_arch = "riscv32"))]
mod interrupts;
#[cfg(target_os = "none")]
mod locked;
#[cfg(target_os = "none")]
mod log;
#[cfg(target_os = "none")]
mod start;
#[cfg(target_os = "none")]
mod tasks;

#[cfg(all(target_os = "none", feature = "defmt-rtt"))]
use defmt_rtt as _;
#[cfg(all(target_os = "none", feature = "defmt-semihosting"))]
use defmt_semihosting as _;

/// The build's limits, which a host may only make stricter.
#[cfg(target_os = "none")]
mod limits {
    use core::ops::RangeInclusive;

    use actq_firmware_demo::deadline;

    /// Ticks per second.
    pub(crate) const TICK_HZ: u32 = deadline::tick_hz(cfg!(feature = "tick-8khz"));
    /// Allowed ticks without an observation, or without an action, before the safe action.
    pub(crate) const DEADLINE: RangeInclusive<u32> = deadline::allowed(TICK_HZ);
    /// Largest age of an observation, relative to the fastest one, in µs.
    pub(crate) const MAX_AGE: u32 = 500_000;
    /// Ticks between two status reports.
    pub(crate) const STATUS_PERIOD: u32 = TICK_HZ / 10;
}
