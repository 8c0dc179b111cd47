//! The thread pool.

use std::{env, thread};

use anyhow::{Context as _, Result};

/// Starts the global thread pool, with one thread for each core of the [`allocation`] if `threads` is 0.
pub(crate) fn start_threads(threads: u16) -> Result<()> {
    let threads = match threads {
        // Rayon's own default is the same, but for Slurm's number, and can be set by RAYON_NUM_THREADS.
        0 => slurm().map_or(0, |_| allocation()),
        given => given.into(),
    };
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start the threads")
}

/// Returns the number of cores that this process may use: of its affinity and its control group, and at most those that
/// Slurm gives a task.
pub(crate) fn allocation() -> usize {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    slurm().map_or(cores, |given| given.min(cores))
}

fn slurm() -> Option<usize> {
    env::var("SLURM_CPUS_PER_TASK").ok()?.parse().ok().filter(|&cores| cores > 0)
}
