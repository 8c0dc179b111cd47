//! Runs one image on a batch of observations: thousands of simulated robots, each with its own state, on all cores.
//!
//! A [`Batch`] is independent heads of one image. Every head gives the bits of [`actq_kernels::Head`], and so those of
//! the microcontroller:
//!
//! ```
//! # fn run(bytes: &[u8], observations: &[f32], done: &[bool], actions: &mut [f32]) -> Result<(), actq_batch::Error> {
//! use actq_batch::Batch;
//!
//! let mut batch = Batch::new(bytes, 4096)?; // checks the image as `Image::new_checked` does
//! // Observations and actions are row-major, a row a head. Heads whose episode is done are reset before their step.
//! batch.step(observations, Some(done), actions)?;
//! # Ok(())
//! # }
//! ```
//!
//! The sums of a product are integers modulo 2^32, and so do not depend on their order: here one load of a weight
//! serves several heads, by the widest vector instructions of the machine (SSE2, SSE4.2, AVX2, AVX-512 or NEON, chosen
//! at run time). With AVX2, weights of at most 4 bits are multiplied as bytes, twice as many by an instruction. All
//! other arithmetic is that of `actq-kernels`, operation for operation in f32. Products and elementwise functions run by
//! vectors; all other operations run by the executor itself, head by head.
#![forbid(unsafe_code)]

mod batch;
mod error;
mod linear;
mod narrow;
mod product;
mod program;
#[cfg(test)]
mod tests;
mod tile;

pub use batch::Batch;
pub use error::Error;
