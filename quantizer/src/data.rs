//! Recorded observations, for calibration and held out. `docs/QUANTIZER.md`, section Recordings, describes the files.

mod arrays;
#[cfg(test)]
mod damaged;
mod dataset;
mod npy;
mod npz;
mod range;
mod recording;
#[cfg(test)]
mod tests;

pub use dataset::{Dataset, Sizes};
pub use range::{Outside, Range, runs};
pub use recording::{Recording, Recordings};
