//! The network: operations over values, their computation in f32 forwards and backwards, and their form in an image.
//!
//! Each operation is defined once, in its file in [`ops`]; everything else uses it through
//! [`operation::Operation`].

mod append;
pub mod arrays;
mod builder;
pub(crate) mod copies;
mod denoising;
mod evaluate;
pub mod hoist;
mod ignored;
pub mod lowering;
mod matrix;
pub mod narrow;
mod nodes;
pub mod operation;
pub mod ops;
mod run;
pub mod steps;
pub mod syntax;
pub(crate) mod tied;
pub mod ties;
pub(crate) mod units;
mod values;
mod weights;

pub use denoising::Denoising;
pub use evaluate::Evaluator;
pub use ignored::{without_effect, without_ignored};
pub use matrix::{Factors, Matrix, MatrixStrip, STRIP};
pub use nodes::{Graph, Node};
pub use ops::NodeKind;
pub use run::{Network, Pass};
pub use values::{ValueId, WeightMatrix};
pub use weights::{Derivatives, State, Vectors, Weights, copy_sample, start_state, zero_state};
