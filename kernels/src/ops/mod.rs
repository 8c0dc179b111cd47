//! The operations of an image.

pub mod cells;
pub mod elementwise;
pub mod linear;
pub mod norm;
