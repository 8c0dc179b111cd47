//! Statistics of a network over recorded observations, collected before anything is quantized.

pub mod allowance;
mod dynamics;
pub mod equalize;
pub mod imagined;
pub mod moments;
pub mod sensitivity;
pub mod widening;
pub mod windows;
