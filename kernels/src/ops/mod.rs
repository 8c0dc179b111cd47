//! The operations of an image.

#[cfg(feature = "writer")]
pub mod cells;
pub mod denoise;
pub mod elementwise;
pub mod linear;
pub mod noise;
pub mod norm;
