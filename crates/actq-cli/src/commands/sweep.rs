//! `actq sweep`

use std::env;
use std::path::{Path, PathBuf};

use actq::data::{Recording, Recordings, Sizes, files_of};
use actq::measure::recorded;
use actq_jobs::host::Host;
use actq_jobs::job::Job;
use actq_jobs::plan;
use actq_jobs::spec::Spec;
use actq_jobs::store::Store;
use anyhow::{Context as _, Result, ensure};

use super::jobs::pool::{Pool, append, complete};
use super::jobs::{merge, plan as plans};
use crate::args::SweepArgs;
use crate::importers::{learned, load, policy_files};
use crate::outputs::files;
use crate::outputs::unfinished::Scratch;
use crate::report::notes;
use crate::terminal::{Progress, note, reserve};
use crate::threads::allocation;

/// Budgets without `--bpw`, in bits per weight.
const BPW: [f64; 4] = [2.0, 2.5, 3.0, 4.0];

/// Quantizes policies by several methods at several budgets, and prints bytes, times and errors. `methods` are names
/// that `host` knows; without any, the defaults of a spec.
pub fn run(args: &SweepArgs, methods: &[String], host: &dyn Host) -> Result<()> {
    let spec = spec_of(args, methods)?;
    let calib = files_of(&args.calib)?;
    let progress = Progress::new(args.run.quiet, "planning")?;
    let spec_jobs = spec.map(|spec| plans::read(spec, host)).transpose()?;
    if let Some(path) = spec.filter(|path| path.extension().is_some_and(|ending| ending == "toml")) {
        let Spec { policies, calib, heldout, .. } = Spec::read(path)?;
        policies.iter().try_for_each(|dir| note_recordings(dir, &calib, heldout.as_deref()))?;
    }
    let inputs: Vec<PathBuf> = match (spec, &spec_jobs) {
        (Some(spec), Some(jobs)) => plans::inputs(spec, jobs),
        _ => {
            let folders = args.policy_dirs.iter().flat_map(|dir| policy_files(dir));
            folders.chain(calib).chain(args.heldout.clone()).collect()
        }
    };
    if let Some(store) = &args.pool.store {
        merge::refuse_inside(store, args.json.iter().chain(&args.pool.log))?;
    }
    if let Some(log) = &args.pool.log {
        files::refuse_input(log, &inputs)?;
    }
    // The log's lines stay: no output replaces it.
    let outputs = reserve(&args.json, inputs.iter().chain(&args.pool.log))?;
    if let Some(log) = &args.pool.log {
        append(log, "")?;
    }
    let cores = if args.run.threads == 0 { allocation() } else { args.run.threads.into() };
    let jobs = match spec_jobs {
        Some(jobs) => jobs,
        None => planned(args, methods, cores, host)?,
    };
    drop(progress);
    let temporary = match &args.pool.store {
        Some(_) => None,
        None => Some(Scratch::new().context("cannot create a temporary folder")?),
    };
    let folder = args.pool.store.as_deref().or(temporary.as_ref().map(Scratch::path));
    let store = Store::open(folder.context("no folder for the results")?, host)?;
    let actq = env::current_exe().context("cannot find the running executable")?;
    let pool = Pool {
        program: &actq,
        cores,
        tries: args.pool.tries.into(),
        log: args.pool.log.as_deref(),
        quiet: args.run.quiet,
        is_kept: temporary.is_none(),
    };
    merge::merge_of(&jobs)?;
    if let Err(error) = complete(&jobs, &store, &pool) {
        merge::report_finished(&jobs, &store)?;
        return Err(error);
    }
    merge::report(&jobs, &|address| store.read_whole(address), outputs, args.json.is_some())
}

/// Returns the spec or plan that is given instead of policies.
fn spec_of<'a>(args: &'a SweepArgs, methods: &[String]) -> Result<Option<&'a Path>> {
    let Some(spec) = args.spec() else { return Ok(None) };
    let name = spec.display();
    ensure!(args.policy_dirs.len() == 1, "{name}: is a spec; sweep it alone");
    ensure!(args.pool.store.is_some(), "{name}: is a spec; add --store DIR, the folder of its results");
    let given = args.of_a_spec().into_iter().chain(Some("--methods").filter(|_| !methods.is_empty()));
    let given: Vec<&str> = given.collect();
    ensure!(given.is_empty(), "{name}: is a spec, which has keys for {}; change them there", given.join(", "));
    Ok(Some(spec))
}

/// Plans the options of the command line.
fn planned(args: &SweepArgs, methods: &[String], cores: usize, host: &dyn Host) -> Result<Vec<Job>> {
    let mut spec = Spec::new(args.policy_dirs.clone());
    spec.calib.clone_from(&args.calib);
    spec.heldout.clone_from(&args.heldout);
    if !methods.is_empty() {
        spec.methods = methods.to_vec();
    }
    spec.bpw = if args.bpw.is_empty() { BPW.to_vec() } else { args.bpw.clone() };
    spec.clock = args.clock.unwrap_or(spec.clock);
    spec.seeds = vec![args.run.seed];
    (spec.steps, spec.effort, spec.relative) = (args.distill.steps, args.distill.effort, args.distill.relative);
    // Fewer images than cores: several cores an image. Results do not depend on it.
    spec.cpus = (cores / (spec.policies.len() * spec.bpw.len() * spec.methods.len())).max(1);
    let jobs = plan::jobs(&spec, host)?;
    for dir in &args.policy_dirs {
        note_recordings(dir, &args.calib, args.heldout.as_deref())?;
    }
    Ok(jobs)
}

/// Prints notes on the recordings of a policy.
fn note_recordings(dir: &Path, calib: &[PathBuf], heldout: Option<&Path>) -> Result<()> {
    let policy = load(dir)?;
    let calib = learned(&policy, &files_of(calib)?)?.map(|learned| learned.dataset);
    let heldout = Recording::Heldout.load(Some(dir), heldout, Sizes::of(&policy))?;
    let mut recordings = Recordings { calib, heldout };
    note(notes::of_recordings(&recordings));
    note(recorded::use_policy(&mut recordings, &policy.graph).iter().map(ToString::to_string));
    Ok(())
}
