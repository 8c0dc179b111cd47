//! Measurements of an image: its errors on recordings, its size, its time on the target, its success.

pub mod actions;
pub mod check;
pub mod eval;
pub mod interval;
pub mod own;
pub mod recorded;
pub mod size;
pub mod time;
pub mod unrounded;
