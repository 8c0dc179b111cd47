//! All kernels in Rust, for any target: the arithmetic of the assembler backends, operation for operation.

#[cfg(feature = "attention")]
mod attention;
#[cfg(feature = "scalar")]
mod bytes;
mod cells;
mod elementwise;
mod gemv;
mod norm;
#[cfg(feature = "scalar")]
mod pairs;
#[cfg(feature = "scalar")]
mod planes;
mod vector;
#[cfg(feature = "helium")]
mod vectors;

#[cfg(feature = "attention")]
pub use attention::{query_keys, weigh_values};
pub use cells::{gru_elements, lstm_elements};
pub use elementwise::{denoise, normalize};
pub use gemv::gemv;
pub use norm::{standardize, sum, sum_squares};
#[cfg(any(not(actq_fpu), feature = "scalar", feature = "helium"))]
pub(crate) use vector::quantize;
#[cfg(actq_scaling)]
pub(crate) use vector::scale_one;
#[cfg(feature = "checksums")]
pub use vector::xor;
pub use vector::{copy, magnitude};
pub use vector::{scale, sqrt};
