//! `actq plan`

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use actq_jobs::host::Host;
use actq_jobs::job::Job;
use actq_jobs::spec::Spec;
use actq_jobs::store::Store;
use actq_jobs::{order, plan};
use anyhow::{Context as _, Result};

use super::host::Command;
use crate::args::jobs::PlanArgs;
use crate::terminal::{note, print};

/// Prints the jobs of a spec.
pub(crate) fn run(args: &PlanArgs) -> Result<()> {
    let mut jobs = read(&args.spec, &Command)?;
    if let Some(folder) = &args.missing {
        let store = Store::open_existing(folder)?;
        let results = store.results(&jobs);
        note(results.damaged.iter().map(|damage| format!("{damage:#}")));
        jobs.retain(|job| !results.has(&job.address));
    }
    jobs.retain(|job| args.stage.is_none_or(|stage| job.stage == stage));
    print(&order::text(&jobs)?)
}

/// Returns the files that the jobs of a spec or plan read, and itself.
pub(crate) fn inputs(spec: &Path, jobs: &[Job]) -> Vec<PathBuf> {
    let files = jobs.iter().flat_map(|job| &job.inputs).map(|input| &input.path);
    let files: BTreeSet<&PathBuf> = files.collect();
    files.into_iter().cloned().chain([spec.to_owned()]).collect()
}

/// Plans a spec, or reads a plan.
pub(crate) fn read(path: &Path, host: &dyn Host) -> Result<Vec<Job>> {
    let name = path.display();
    if path.extension().is_some_and(|ending| ending == "toml") {
        return plan::jobs(&Spec::read(path)?, host).with_context(|| name.to_string());
    }
    let text = fs::read_to_string(path).with_context(|| format!("{name}: cannot read the file"))?;
    order::read(&text).with_context(|| {
        format!("{name}: is not a plan; name a spec with the ending .toml, or the output of `actq plan`")
    })
}
