//! The commands for sweeps as jobs.

mod host;
pub(crate) mod job;
pub(crate) mod merge;
pub(crate) mod plan;
pub(crate) mod pool;
