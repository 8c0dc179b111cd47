//! The STM32F405 of ODrive v3, VESC and Crazyflie: a Cortex-M4 with FPU at 168 MHz.

pub mod flash;
pub mod watchdog_time;

#[cfg(not(target_os = "none"))]
pub(crate) mod host;
#[cfg(target_os = "none")]
pub mod target;

/// Scratch memory in words: 48 of the 128 KB of RAM.
pub(crate) const SCRATCH: usize = 12 * 1024;
