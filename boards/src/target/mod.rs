//! Peripherals and core registers that several boards share.

#[cfg(feature = "cmsdk")]
pub(crate) mod cmsdk;
#[cfg(not(any(feature = "mps2-an505", feature = "mps3-an547")))]
pub(crate) mod mpu;
#[cfg(any(feature = "mps2-an505", feature = "mps3-an547"))]
pub(crate) mod msplim;
pub(crate) mod stack;
pub(crate) mod vectors;
