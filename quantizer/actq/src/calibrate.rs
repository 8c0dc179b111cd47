//! Statistics of a network over recorded observations, collected before anything is quantized.

pub mod allowance;
pub mod moments;
pub mod sensitivity;
pub mod widening;
pub mod windows;
