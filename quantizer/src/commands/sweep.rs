//! `actq sweep`

use std::path::PathBuf;

use actq::data::{Recording, Recordings, Sizes, files_of};
use actq::methods::Method;
use actq::pipeline::sweep::{self, SweepPlan};
use anyhow::{Result, bail, ensure};

use crate::args::SweepArgs;
use crate::importers::{learned, load, policy_files};
use crate::report::{self, notes};
use crate::terminal::{Progress, note, print, reserve};
use crate::threads::start_threads;

/// Quantizes policies by several methods at several budgets and compares the errors.
pub fn run(args: &SweepArgs, methods: &[Method]) -> Result<()> {
    let is_spec = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "toml" || ending == "jsonl");
    if let Some(spec) = args.policy_dirs.iter().find(is_spec) {
        bail!("{}: is a spec; add --store DIR, the folder of its results", spec.display());
    }
    let folders = args.policy_dirs.iter().flat_map(|dir| policy_files(dir));
    let calib = files_of(&args.calib)?;
    let inputs = folders.chain(calib.iter().chain(&args.heldout).cloned());
    let outputs = reserve(args.svg.iter().chain(&args.json), inputs)?;
    let progress = Progress::new(args.run.quiet, "reading")?;
    start_threads(args.run.threads)?;
    let policies = args.policy_dirs.iter().map(|dir| load(dir)).collect::<Result<Vec<_>>>()?;
    let named = !calib.is_empty() || args.heldout.is_some();
    ensure!(
        policies.len() == 1 || !named,
        "--calib and --heldout apply to one policy, and {} are given; sweep each policy in its own command",
        policies.len()
    );
    let mut sweeps = Vec::new();
    for (p, policy) in policies.iter().enumerate() {
        let (dir, sizes) = (Some(policy.dir.as_path()), Sizes::of(policy));
        let calib = learned(policy, &calib)?.map(|learned| learned.dataset);
        let heldout = Recording::Heldout.require(dir, args.heldout.as_deref(), sizes, "actq sweep")?;
        let recordings = Recordings { calib, heldout: Some(heldout) };
        note(notes::of_recordings(&recordings));
        let plan = SweepPlan {
            policy,
            recordings,
            methods,
            budgets: &args.bpw,
            clock_hz: args.clock,
            steps: args.learn.steps,
            effort: args.learn.effort,
            minutes: args.learn.minutes,
            relative: args.learn.relative,
            seed: args.run.seed,
        };
        sweeps.push(sweep::run(plan, |work: &str, share: f64| {
            progress.set(&format!("{}: {work}", policy.name), (p as f64 + share) / policies.len() as f64);
        })?);
    }
    drop(progress);
    print(&report::sweep::report(&sweeps))?;
    let (svg, json) = (report::sweep::svg(&sweeps), serde_json::to_string_pretty(&sweeps)? + "\n");
    let contents = [args.svg.is_some().then_some(svg), args.json.is_some().then_some(json)];
    outputs.write(&contents.into_iter().flatten().collect::<Vec<_>>())
}
