//! `actq merge`

use actq_jobs::host::Host;
use actq_jobs::job::Job;
use actq_jobs::merged::Merged;
use actq_jobs::record::Outcome;
use actq_jobs::run;
use actq_jobs::store::Store;
use anyhow::{Context as _, Result, ensure};

use super::host::Command;
use super::plan;
use crate::args::jobs::MergeArgs;
use crate::outputs::files::Outputs;
use crate::report::{frontiers, merged};
use crate::terminal::{print, reserve};

/// Prints the results of a sweep.
pub(crate) fn run(args: &MergeArgs) -> Result<()> {
    let outputs = reserve(args.svg.iter().chain(&args.json), [&args.spec])?;
    let jobs = plan::read(&args.spec, &Command)?;
    let store = Store::open(&args.store, &Command)?;
    let left = jobs.iter().filter(|job| job.work.kind() != "merge" && !store.has(&job.address)).count();
    ensure!(
        left == 0,
        "{}: {left} of {} jobs have no result yet; run `actq sweep {} --store {}`",
        args.store.display(),
        jobs.len(),
        args.spec.display(),
        args.store.display()
    );
    report(&jobs, &store, &Command, outputs, args.svg.is_some(), args.json.is_some())
}

/// Prints the results of a plan that are in the store, and writes the outputs: a plot, then figures as JSON.
pub(crate) fn report(
    jobs: &[Job],
    store: &Store,
    host: &dyn Host,
    outputs: Outputs,
    svg: bool,
    json: bool,
) -> Result<()> {
    let merged = merged(jobs, store, host)?;
    print(&merged::report(&merged))?;
    let svg = svg.then(|| frontiers::svg(&merged));
    let json = if json { Some(serde_json::to_string_pretty(&merged)? + "\n") } else { None };
    outputs.write(&svg.into_iter().chain(json).collect::<Vec<_>>())
}

fn merged(jobs: &[Job], store: &Store, host: &dyn Host) -> Result<Merged> {
    let merge = jobs.iter().find(|job| job.work.kind() == "merge");
    let merge = merge.context("the plan has no job of kind merge; plan the whole spec")?;
    run::run(merge, store, host, &mut |_, _| ())?;
    match store.read(&merge.address)? {
        Outcome::Merged(merged) => Ok(merged),
        _ => anyhow::bail!("{}: the result is not of kind merge", merge.address),
    }
}
