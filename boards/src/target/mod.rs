//! Peripherals and core registers that several boards share.

#[cfg(feature = "cmsdk")]
pub(crate) mod cmsdk;
#[cfg(not(feature = "armv8m"))]
pub(crate) mod mpu;
#[cfg(feature = "armv8m")]
pub(crate) mod msplim;
pub(crate) mod stack;
pub(crate) mod vectors;
