//! The thread pool.

use anyhow::{Context as _, Result};

/// Starts the global thread pool, with one thread for each core if `threads` is 0.
pub(crate) fn start_threads(threads: u16) -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global().context("cannot start the threads")
}
