//! The thread pool.

use std::hint::black_box;
use std::{env, thread};

use anyhow::{Context as _, Result};

/// Starts the global thread pool, with one thread for each core of the [`allocation`] if `threads` is 0.
pub(crate) fn start_threads(threads: u16) -> Result<()> {
    let threads = match threads {
        // Rayon's own default is the same, but for Slurm's number, and can be set by RAYON_NUM_THREADS.
        0 => slurm().map_or(0, |_| allocation()),
        given => given.into(),
    };
    keep_freed_memory();
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("cannot start the threads")
}

/// Frees one large block. From then on, glibc keeps freed memory up to twice this size for the next allocation. Before,
/// it returns a learner's arrays to the kernel in every step and gets them back page by page. Other allocators ignore
/// it. (mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD)
fn keep_freed_memory() {
    const BLOCK: usize = 31 << 20;
    drop(black_box(Vec::<u8>::with_capacity(BLOCK)));
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
