//! The threads of the work.

use anyhow::{Context as _, Result};

/// Starts the threads, one for each core if `threads` is 0.
pub(crate) fn start_threads(threads: u16) -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global().context("threads cannot be started")
}
