//! `actq tune`

use std::fs;
use std::path::{Path, PathBuf};

use actq::budget::Budget;
use actq::data::{Dataset, Recording, Sizes, files_of};
use actq::error::Error;
use actq::methods::{Method, Options};
use actq::pipeline::tune::{self, TunePlan};
use actq_kernels::Width;
use anyhow::{Context as _, Result, ensure};

use super::drive::Drive;
use crate::args::{LearnArgs, TuneArgs};
use crate::importers::{load, policy_files};
use crate::outputs::unfinished::Scratch;
use crate::report;
use crate::terminal::{Progress, note, print, reserve};
use crate::threads::start_threads;

/// Quantizes, drives, and learns again from what was driven.
pub(crate) fn run(args: &TuneArgs) -> Result<()> {
    let outputs: Vec<&Path> = [Some(&args.out), args.json.as_ref()].into_iter().flatten().map(|p| &**p).collect();
    let mut calib = files_of(&args.calib)?;
    let inputs: Vec<PathBuf> = policy_files(&args.policy_dir).into_iter().chain(calib.iter().cloned()).collect();
    let outputs = reserve(&outputs, &inputs)?;
    let progress = Progress::new(args.run.quiet, "reading")?;
    let policy = load(&args.policy_dir)?;
    let sizes = Sizes::of(&policy);
    if calib.is_empty() {
        calib.extend(Recording::Calib.find(&args.policy_dir)?);
    }
    let load = |file: &PathBuf| Dataset::load(file, sizes);
    let calib = calib.iter().map(load).collect::<Result<Vec<_>, _>>()?;
    let heldout = Recording::Heldout.load(Some(&args.policy_dir), None, sizes)?;
    let folder = Folder::new(args.keep.as_deref())?;
    let drive = Drive::new(&args.drive, &policy, folder.path())?;
    start_threads(args.run.threads)?;
    let budget = match args.bpw {
        Some(bits) => Budget::BitsPerWeight(bits),
        None => Budget::Width(args.bits.unwrap_or(Width::W3)),
    };
    let LearnArgs { steps, minutes, relative } = args.learn;
    let options = Options { steps, minutes, relative, seed: args.run.seed, ..Options::new(Method::Distill, budget) };
    let plan = TunePlan { policy: &policy, calib, heldout, options: &options, rounds: args.rounds };
    let tuned = tune::run(
        plan,
        |round, image| {
            progress.begin(&format!("round {round}: driving"));
            // The command prints while it drives.
            progress.without_bar(|| drive.run(round, image)).map_err(Error::other)
        },
        |work, share| progress.set(work, share),
    );
    drop(progress);
    let tuned = tuned.with_context(|| match &args.keep {
        Some(dir) => format!("nothing is written but what {} holds", dir.display()),
        None => "nothing is written (--keep DIR keeps the images and what they drove)".to_owned(),
    })?;
    let json = serde_json::to_string_pretty(&report::tuned::json(&tuned, &policy.name, &args.drive))? + "\n";
    let table = args.json.is_some().then_some(json.as_bytes());
    outputs.write(&[&tuned.quantized.image[..]].into_iter().chain(table).collect::<Vec<_>>())?;
    print(&format!(
        "{}\n{}: {} bytes, the image of round {}\n",
        report::tuned::table(&tuned),
        args.out.display(),
        tuned.quantized.image.len(),
        args.rounds
    ))?;
    note(report::tuned::better(&tuned, args.keep.as_deref()));
    Ok(())
}

/// Where images and recordings are while rounds are run.
enum Folder {
    Kept(PathBuf),
    Gone(Scratch),
}

impl Folder {
    /// The folder to keep, which is made or is empty, so that no recording of another time is among them; else one that
    /// goes.
    fn new(keep: Option<&Path>) -> Result<Self> {
        let Some(dir) = keep else {
            return Ok(Self::Gone(Scratch::new().context("cannot make a temporary folder for recordings")?));
        };
        let name = dir.display();
        if !dir.exists() {
            fs::create_dir(dir).with_context(|| format!("{name}: cannot be made"))?;
        }
        let mut entries = fs::read_dir(dir).with_context(|| format!("{name}: cannot be read"))?;
        ensure!(entries.next().is_none(), "{name}: is not empty; --keep needs a folder of its own");
        Ok(Self::Kept(dir.to_owned()))
    }

    fn path(&self) -> &Path {
        match self {
            Self::Kept(path) => path,
            Self::Gone(folder) => folder.path(),
        }
    }
}
