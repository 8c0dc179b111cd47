//! Everything in plain Rust, for any target: the arithmetic of the assembler backends, operation for operation.

mod cells;
mod gemv;
mod vector;

pub use cells::{gru_elements, lstm_elements};
pub use gemv::gemv;
pub use vector::{copy, magnitude, quantize, scale, sqrt};
