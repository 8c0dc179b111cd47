//! `actq job`

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;
use std::time::{Duration, Instant};

use actq_jobs::host::Host;
use actq_jobs::job::Job;
use actq_jobs::run;
use actq_jobs::store::Store;
use anyhow::{Context as _, Result};
use serde_json::json;

use crate::args::jobs::JobArgs;
use crate::terminal::print;
use crate::threads::{allocation, start_threads};

/// The least time between two lines of progress.
const BETWEEN_LINES: Duration = Duration::from_millis(500);

/// Runs one job in this process.
pub fn run(args: &JobArgs, host: &dyn Host) -> Result<()> {
    let job = read(&args.job)?;
    let threads = match args.threads {
        0 => u16::try_from(job.cpus.min(allocation())).unwrap_or(u16::MAX),
        given => given,
    };
    start_threads(threads)?;
    let store = Store::open(&args.store, host)?;
    let begun = Instant::now();
    let mut reported: Option<Instant> = None;
    let ran = run::run(&job, &store, host, &mut |work, share| {
        if args.progress && reported.is_none_or(|at| at.elapsed() >= BETWEEN_LINES) {
            reported = Some(Instant::now());
            // A reader that has ended does not stop the job.
            drop(print(&format!("{}\n", json!({"work": work, "share": share}))));
        }
    })?;
    if args.progress {
        let seconds = begun.elapsed().as_secs_f64();
        print(&format!("{}\n", json!({"address": job.address, "cached": !ran, "seconds": seconds})))?;
    }
    Ok(())
}

fn read(path: &Path) -> Result<Job> {
    let mut text = String::new();
    let name = if path == Path::new("-") {
        io::stdin().read_to_string(&mut text).context("cannot read the job from standard input")?;
        "standard input".to_owned()
    } else {
        text = fs::read_to_string(path).with_context(|| format!("{}: cannot read the file", path.display()))?;
        path.display().to_string()
    };
    serde_json::from_str(&text).with_context(|| format!("{name}: is not one job, a line of `actq plan`"))
}
