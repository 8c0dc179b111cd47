//! Image slots: the image that runs after each update and after each loss of power.

mod device;
mod flash;
mod power;
#[cfg(feature = "signature")]
mod signatures;
mod updates;
