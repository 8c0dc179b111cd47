//! The process that works: a fork of it has none of its threads.

use std::sync::atomic::{AtomicU32, Ordering};

use pyo3::prelude::*;

use crate::error::error;

/// The process whose threads work; 0 before the first work.
static OWNER: AtomicU32 = AtomicU32::new(0);

/// Refuses work in a process that was forked after work began: the threads that would do it are not in it, and waiting
/// for them would never end.
pub(crate) fn refuse_forked() -> PyResult<()> {
    let own = std::process::id();
    match OWNER.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed) {
        Err(owner) if owner != own => Err(error!(
            "this process was forked from one that had used actq; start worker processes by spawn, or use actq in the parent only"
        )),
        _ => Ok(()),
    }
}
