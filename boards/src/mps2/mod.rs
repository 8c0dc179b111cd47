//! Arm's MPS2 with its FPGA images AN385, AN386, AN500 and AN505, whose peripherals MPS3 has, too.

#[cfg(not(target_os = "none"))]
pub(crate) mod host;
#[cfg(target_os = "none")]
pub mod target;

/// Scratch memory that the application gives to a head, in words.
pub(crate) const SCRATCH: usize = 24 * 1024;
