//! Peripherals and core registers that several boards share.

#[cfg(feature = "cmsdk")]
pub(crate) mod cmsdk;
#[cfg(any(feature = "mps2-an386", feature = "mps2-an500", feature = "stm32f405"))]
pub(crate) mod mpu;
#[cfg(feature = "mps2-an505")]
pub(crate) mod msplim;
pub(crate) mod stack;
pub(crate) mod vectors;
