//! Peripherals and core registers that several boards share.

#[cfg(feature = "cmsdk")]
pub(crate) mod cmsdk;
#[cfg(feature = "armv6m")]
pub(crate) mod lowest;
#[cfg(all(target_arch = "arm", not(any(feature = "armv6m", feature = "armv8m"))))]
pub(crate) mod mpu;
#[cfg(feature = "armv8m")]
pub(crate) mod msplim;
#[cfg(target_arch = "riscv32")]
pub(crate) mod pmp;
pub(crate) mod stack;
#[cfg(target_arch = "arm")]
pub(crate) mod systick;
#[cfg(target_arch = "arm")]
pub(crate) mod vectors;
