//! Image slots: what runs after every update, and after every loss of power.

mod device;
mod nor;
mod power;
#[cfg(feature = "signature")]
mod signatures;
mod updates;
