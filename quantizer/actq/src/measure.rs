//! Measurements of an image: its errors on recordings, its size, its time on the target.

pub mod actions;
pub mod check;
pub mod eval;
pub mod own;
pub mod size;
pub mod time;
pub mod unrounded;
