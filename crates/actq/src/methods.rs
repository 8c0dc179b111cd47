//! Quantization of weight matrices to codes and scales.

pub mod distill;
pub mod gptq;
mod learning;
pub mod matrixwise;
mod options;
mod packing;
mod prepared;
mod progress;
mod quantized;
pub mod scale;

pub use crate::calibrate::allowance::Sampled;
pub use crate::calibrate::imagined::Imagined;
pub use learning::{Choice, Learning, Recipe, Trial};
pub use options::{CustomMethod, CustomStatistics, Effort, MAX_MINUTES, Method, Options};
pub use packing::{Activations, Packing};
pub use prepared::{PreparedMethod, least_bytes, quantize};
pub use progress::Progress;
pub use quantized::{Outcome, Quantized, QuantizedNetwork, RowAllocation};
