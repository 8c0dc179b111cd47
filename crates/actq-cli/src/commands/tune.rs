//! `actq tune`

use std::fs;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, Recording, Sizes, files_of};
use actq::error::Error;
use actq::graph::Graph;
use actq::methods::{Method, Options};
use actq::pipeline::check_budget;
use actq::pipeline::tune::{self, TunePlan};
use anyhow::{Context as _, Result, ensure};

use super::drive::Drive;
use crate::args::{DistillArgs, LearnArgs, TuneArgs};
use crate::importers::{load, policy_files};
use crate::outputs::files::refuse_foreign;
use crate::outputs::unfinished::{OutputFolder, Scratch};
use crate::report;
use crate::terminal::{Progress, note, print, reserve};
use crate::threads::start_threads;

/// Quantizes in on-policy rounds: rolls out, labels, and learns again.
pub(crate) fn run(args: &TuneArgs) -> Result<()> {
    let calib = files_of(&args.calib)?;
    // Before the outputs, which may be in this folder.
    let folder = Folder::new(args.keep.as_deref())?;
    for output in [&args.out].into_iter().chain(&args.json) {
        folder.refuse_output(output)?;
    }
    let inputs = policy_files(&args.policy_dir).into_iter().chain(calib.iter().cloned());
    let outputs = reserve([&args.out].into_iter().chain(&args.json), inputs)?;
    refuse_foreign(&args.out)?;
    let progress = Progress::new(args.run.quiet, "reading")?;
    let policy = load(&args.policy_dir)?;
    ensure!(
        policy.around.is_none(),
        "{}: rounds with a deploy.toml are not supported yet; record by `actq serve --record`, and pass the recordings to \
         `actq quantize --calib`",
        args.policy_dir.display()
    );
    let options = options(args, &policy.graph);
    options.check()?;
    options.check_length()?;
    check_budget(&policy, &options)?;
    let sizes = Sizes::of(&policy);
    let calib = calibration(args, calib, sizes)?;
    let heldout = Recording::Heldout.load(Some(&args.policy_dir), None, sizes)?;
    let drive = Drive::new(&args.drive, &policy, folder.path())?;
    start_threads(args.run.threads)?;
    let plan = TunePlan { policy: &policy, calib, heldout, options: &options, rounds: args.rounds };
    let tuned = tune::run(
        plan,
        |round, image| {
            progress.begin(&format!("round {round}: rollout"));
            // The command prints during the rollout.
            progress.without_bar(|| drive.run(round, image)).map_err(Error::other)
        },
        |work: &str, share: f64| progress.set(work, share),
    );
    drop(progress);
    let tuned = tuned.with_context(|| match &args.keep {
        Some(dir) => format!("no image is written; {} holds the images and recordings so far", dir.display()),
        None => "no image is written; pass --keep DIR to keep images and recordings after an error".to_owned(),
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
    note(tuned.differences.iter().map(ToString::to_string));
    note(report::tuned::better(&tuned, args.keep.as_deref()));
    Ok(())
}

/// Returns the options of the command line.
fn options(args: &TuneArgs, graph: &Graph) -> Options {
    let method = Method::Distill;
    let default = || method.default_budget(graph, method.default_group(), false);
    let budget = args.budget.budget(None).unwrap_or_else(default);
    let LearnArgs { distill: DistillArgs { effort, steps, relative }, minutes } = args.learn;
    Options { effort, steps, minutes, relative, seed: args.run.seed, ..Options::new(method, budget) }
}

/// Reads the recordings of the f32 policy: the given files, or those in the policy folder.
fn calibration(args: &TuneArgs, mut files: Vec<PathBuf>, sizes: Sizes) -> Result<Vec<Dataset>> {
    if files.is_empty() {
        files.extend(Recording::Calib.find(&args.policy_dir)?);
        ensure!(!files.is_empty(), "{}", Recording::Calib.missing("actq tune"));
    }
    Ok(files.iter().map(|file| Dataset::load(file, sizes)).collect::<Result<Vec<_>, _>>()?)
}

/// The folder of images and recordings during the rounds.
enum Folder {
    Kept {
        path: PathBuf,
        /// Its drop removes the folder if it is still empty.
        _made: OutputFolder,
    },
    Temporary(Scratch),
}

impl Folder {
    /// Creates the folder to keep, which must be new or empty to hold no older recordings; without one, a temporary
    /// folder.
    fn new(keep: Option<&Path>) -> Result<Self> {
        let Some(dir) = keep else {
            return Ok(Self::Temporary(Scratch::new().context("cannot create a temporary folder for recordings")?));
        };
        let name = dir.display();
        let _made = OutputFolder::new(dir)?;
        let mut entries = fs::read_dir(dir).with_context(|| format!("{name}: cannot read the folder"))?;
        ensure!(entries.next().is_none(), "{name}: is not empty; pass a new or empty folder to --keep");
        Ok(Self::Kept { path: dir.to_owned(), _made })
    }

    /// Refuses an output in the folder with the name of a round's image or recordings.
    fn refuse_output(&self, output: &Path) -> Result<()> {
        let parent = output.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let is_inside = fs::canonicalize(parent).ok() == fs::canonicalize(self.path()).ok();
        let is_of_round = output.file_name().is_some_and(|name| name.to_string_lossy().starts_with("round-"));
        ensure!(
            !is_inside || !is_of_round,
            "{}: round-... in the folder of --keep is the name of a round's image or recordings; choose another name",
            output.display()
        );
        Ok(())
    }

    fn path(&self) -> &Path {
        match self {
            Self::Kept { path, .. } => path,
            Self::Temporary(folder) => folder.path(),
        }
    }
}
