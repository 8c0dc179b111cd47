//! Files that the command writes.

pub mod files;
pub mod unfinished;
