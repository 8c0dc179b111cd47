//! Everything in plain Rust, for any target: the arithmetic of the assembler backends, operation for operation.

mod cells;
mod elementwise;
mod gemv;
mod norm;
mod vector;

pub(crate) use cells::{gru_elements, lstm_elements};
pub(crate) use elementwise::{denoise, normalize};
pub use gemv::gemv;
pub(crate) use norm::{standardize, sum, sum_squares};
pub(crate) use vector::{copy, magnitude, quantize, scale, sqrt};
