//! `actq merge`

use std::fs;
use std::path::{Path, PathBuf};

use actq::text::count;
use actq_jobs::job::Job;
use actq_jobs::record::Outcome;
use actq_jobs::results::Merged;
use actq_jobs::run::{self, Read};
use actq_jobs::store::Store;
use actq_jobs::work::{Merge, Work};
use anyhow::{Context as _, Result, ensure};

use super::host::Command;
use super::plan;
use crate::args::jobs::MergeArgs;
use crate::outputs::files::Outputs;
use crate::report::sweep_table;
use crate::terminal::{note, print, reserve};

/// Prints the results of a sweep.
pub(crate) fn run(args: &MergeArgs) -> Result<()> {
    let jobs = plan::read(&args.spec, &Command)?;
    let store = Store::open_existing(&args.store)?;
    refuse_inside(&args.store, &args.json)?;
    let outputs = reserve(&args.json, plan::inputs(&args.spec, &jobs))?;
    let results = store.results(&jobs);
    let damaged = &results.damaged;
    note(damaged.iter().map(|damage| format!("{damage:#}")));
    ensure!(
        damaged.is_empty(),
        "{}: {} damaged; run `actq sweep {} --store {}`, which makes them again",
        args.store.display(),
        count(damaged.len(), "result"),
        args.spec.display(),
        args.store.display()
    );
    let left = jobs.iter().filter(|job| job.work.kind() != "merge" && !results.has(&job.address)).count();
    ensure!(
        left == 0,
        "{}: {left} of {} jobs have no result yet; run `actq sweep {} --store {}`",
        args.store.display(),
        jobs.len(),
        args.spec.display(),
        args.store.display()
    );
    report(&jobs, &|address| results.get(address), outputs, args.json.is_some())
}

/// Prints the rows of a plan whose images and errors are in the store, after some jobs have failed.
pub(crate) fn report_finished(jobs: &[Job], store: &Store) -> Result<()> {
    let merge = rows_of(merge_of(jobs)?)?;
    let Some(finished) = run::merge_finished(merge, &store.results(jobs))? else { return Ok(()) };
    let rows: usize = finished.policies.iter().map(|policy| policy.images.len()).sum();
    print(&sweep_table::report(&finished))?;
    note([format!("the table has {rows} of {}, and no success where a drive failed", count(merge.rows.len(), "row"))]);
    Ok(())
}

/// Refuses outputs among the files of a store.
pub(crate) fn refuse_inside<'a>(store: &Path, outputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    let whole = |path: &Path| fs::canonicalize(path).or_else(|_| std::path::absolute(path)).ok();
    for output in outputs {
        let folder = output.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
        ensure!(
            whole(folder).is_none_or(|folder| Some(folder) != whole(store)),
            "{}: is in the store; choose another folder",
            output.display()
        );
    }
    Ok(())
}

/// Prints the results of a plan that are in the store, and writes its figures as JSON.
pub(crate) fn report(jobs: &[Job], read: Read<'_>, outputs: Outputs, json: bool) -> Result<()> {
    let merged = merged(jobs, read)?;
    print(&sweep_table::report(&merged))?;
    let json = if json { Some(serde_json::to_string_pretty(&merged)? + "\n") } else { None };
    outputs.write(&json.into_iter().collect::<Vec<_>>())
}

/// Returns the plan's job of kind merge.
///
/// # Errors
///
/// If there is none, or several.
pub(crate) fn merge_of(jobs: &[Job]) -> Result<&Job> {
    let mut found = jobs.iter().filter(|job| job.work.kind() == "merge");
    let merge = found.next().context("the plan has no job of kind merge; plan the whole spec")?;
    anyhow::ensure!(
        found.next().is_none(),
        "the plan has several jobs of kind merge, as of several specs; run each plan alone"
    );
    Ok(merge)
}

fn rows_of(job: &Job) -> Result<&Merge> {
    let Work::Merge(merge) = &job.work else { anyhow::bail!("{}: is not of kind merge", job.title) };
    Ok(merge)
}

/// Returns the results of a plan: those of its merge if that has run, or else of its other jobs. It writes nothing.
fn merged(jobs: &[Job], read: Read<'_>) -> Result<Merged> {
    let job = merge_of(jobs)?;
    match read(&job.address) {
        Ok(Outcome::Merged(merged)) => Ok(merged),
        Err(_) => Ok(run::merge(rows_of(job)?, read)?),
        Ok(_) => anyhow::bail!("{}: the result is not of kind merge", job.address),
    }
}
