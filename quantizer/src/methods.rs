//! Weight matrices into codes and scales.

pub mod actquant;
pub mod best;
pub mod gptq;
pub mod matrixwise;
mod options;
mod prepared;
mod quantized;
pub mod scale;

pub use options::{Activations, Method, Options, Packing};
pub use prepared::{PreparedMethod, quantize};
pub use quantized::{Outcome, Quantized, RowAllocation};
