//! Output files of the command.

pub mod files;
pub mod unfinished;
