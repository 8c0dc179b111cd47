//! The commands for sweeps as jobs.

pub mod host;
pub mod job;
pub(crate) mod merge;
pub(crate) mod plan;
pub mod pool;
