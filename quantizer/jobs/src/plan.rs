//! The jobs of a spec.

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Recording, Sizes};
use actq::error::{Context as _, Result, ensure};
use actq::policy::Policy;

use crate::estimate;
use crate::host::Host;
use crate::job::{Drive, Episodes, Evaluate, Input, Job, Learn, Make, Merge, Role, Row, Work, address};
use crate::order;
use crate::spec::{self, MOST_JOBS, Spec};

/// Returns the jobs of a spec, each after those that it depends on; the last one merges the results.
///
/// # Errors
///
/// If a policy, a recording or another file is missing or damaged; if a method is unknown; if two jobs would have one
/// address.
pub fn jobs(spec: &Spec, host: &dyn Host) -> Result<Vec<Job>> {
    let mut plan = Plan { spec, jobs: Vec::new(), rows: Vec::new() };
    let mut names: Vec<String> = Vec::new();
    for path in &spec.policies {
        let source = Source::read(path, host).with_context(|| path.display().to_string())?;
        let name = &source.policy.name;
        ensure!(!names.contains(name), "two policies are named {name:?}; change the name in one of them");
        names.push(name.clone());
        for method in &spec.methods {
            for &bpw in &spec.bpw {
                for &seed in &spec.seeds {
                    plan.image(names.len() - 1, &source, method, bpw, seed, host)?;
                }
            }
            ensure!(plan.jobs.len() < MOST_JOBS, "the spec has more than {MOST_JOBS} jobs; divide it");
        }
    }
    let deps = plan.jobs.len();
    let merge = Work::Merge(Merge { policies: names, rows: std::mem::take(&mut plan.rows) });
    plan.add("merge".to_owned(), merge, Vec::new(), (1, 64, estimate::merging(deps)))?;
    order::check(&plan.jobs)?;
    Ok(plan.jobs)
}

/// A policy with its files.
struct Source {
    policy: Policy,
    path: PathBuf,
    files: Vec<Input>,
    calib: Option<(Input, u64)>,
    heldout: Input,
    /// Observations of each episode of the held-out recording.
    lengths: Vec<usize>,
}

impl Source {
    fn read(path: &Path, host: &dyn Host) -> Result<Self> {
        let policy = host.load(path)?;
        let files: Vec<PathBuf> = host.files(path).into_iter().filter(|file| file.is_file()).collect();
        let files = files.into_iter().map(|file| Input::of(Role::Policy, file)).collect::<Result<_>>()?;
        let calib = match Recording::Calib.find(path)? {
            Some(file) => {
                let bytes = std::fs::metadata(&file).map_or(0, |file| file.len());
                Some((Input::of(Role::Calib, file)?, bytes))
            }
            None => None,
        };
        let heldout = Recording::Heldout.find(path)?.with_context(|| Recording::Heldout.missing("a sweep"))?;
        let lengths = Dataset::load(&heldout, Sizes::of(&policy))?.length;
        Ok(Self { policy, path: path.to_owned(), files, calib, heldout: Input::of(Role::Heldout, heldout)?, lengths })
    }

    /// Returns the policy's files with a recording.
    fn with(&self, recording: impl IntoIterator<Item = Input>) -> Vec<Input> {
        self.files.iter().cloned().chain(recording).collect()
    }
}

/// A plan in the making.
struct Plan<'a> {
    spec: &'a Spec,
    jobs: Vec<Job>,
    rows: Vec<Row>,
}

impl Plan<'_> {
    /// Adds a job and returns its address. `size` has its cores, memory in MiB and seconds.
    fn add(&mut self, title: String, work: Work, inputs: Vec<Input>, size: (usize, u64, f64)) -> Result<String> {
        let address = address(&work, &inputs)?;
        let deps = work.deps();
        // Look from the last one backwards: dependencies are near.
        let of = |dep: &String| self.jobs.iter().rev().find(|job| job.address == *dep).map_or(0, |job| job.stage + 1);
        let stage = match work {
            // The merge depends on all.
            Work::Merge(_) => self.jobs.iter().map(|job| job.stage + 1).max().unwrap_or(0),
            _ => deps.iter().map(of).max().unwrap_or(0),
        };
        let (cpus, memory_mib, seconds) = size;
        let job = Job { address: address.clone(), title, work, inputs, deps, stage, cpus, memory_mib, seconds };
        self.jobs.push(job);
        Ok(address)
    }

    /// Adds an image with its measurements, and those of its on-policy rounds.
    fn image(
        &mut self,
        policy: usize,
        source: &Source,
        name: &str,
        bpw: f64,
        seed: u64,
        host: &dyn Host,
    ) -> Result<()> {
        let (spec, graph) = (self.spec, &source.policy.graph);
        let method = host.method(name)?;
        // The options of learning apply to distill alone.
        let learns = name == "distill";
        let needs_calib = name != "rtn";
        let calib = source.calib.as_ref().filter(|_| needs_calib);
        ensure!(!needs_calib || calib.is_some(), "{}", Recording::Calib.missing(&format!("method {name}")));
        let make = Make {
            policy: Some(source.path.clone()),
            method: name.to_owned(),
            bpw,
            steps: spec.steps.filter(|_| learns),
            relative: spec.relative && learns,
            seed,
        };
        let title = format!("{}, {name} at {bpw} bits, seed {seed}", source.policy.name);
        let seconds = estimate::making(graph, &method, spec);
        let recordings = calib.map_or(0, |(_, bytes)| *bytes);
        let size = (spec.cpus, estimate::memory_mib(graph, recordings), seconds);
        let inputs = source.with(calib.map(|(input, _)| input.clone()));
        let first = self.add(format!("{title}: quantize"), Work::Quantize(make.clone()), inputs.clone(), size)?;
        let row = |image: String, round| Row {
            policy,
            method: name.to_owned(),
            bpw,
            seed,
            round,
            image,
            evaluations: Vec::new(),
            drives: Vec::new(),
        };
        self.measure(source, &title, row(first.clone(), 0))?;
        let Some((learn, drive)) = spec.learn.as_ref().zip(spec.drive.as_ref()).filter(|_| learns) else {
            return Ok(());
        };
        let (mut image, mut recordings) = (first, Vec::new());
        for round in 1..=learn.rounds {
            let first = learn.first_seed + (round as u64 - 1) * learn.episodes;
            for seeds in ranges(first, learn.episodes, drive.per_job) {
                let title = format!("{title}: roll out for round {round}, seeds {}", range(seeds));
                recordings.push(self.drive(source, title, &image, drive, seeds, true)?);
            }
            let title = format!("{title}, round {round}");
            let work = Work::Learn(Learn { make: make.clone(), round, recordings: recordings.clone() });
            image = self.add(format!("{title}: learn again"), work, inputs.clone(), size)?;
            self.measure(source, &title, row(image.clone(), round))?;
        }
        Ok(())
    }

    /// Adds the measurements of an image, and its row.
    fn measure(&mut self, source: &Source, title: &str, mut row: Row) -> Result<()> {
        let per_job = self.spec.evaluate.per_job.map(|n| n as u64);
        for episodes in ranges(0, source.lengths.len() as u64, per_job) {
            let title = format!("{title}: evaluate episodes {}", range(episodes));
            let evaluate = Evaluate { image: row.image.clone(), policy: Some(source.path.clone()), episodes };
            let part = &source.lengths[episodes.first as usize..][..episodes.count as usize];
            let seconds = estimate::evaluating(&source.policy.graph, part.iter().sum());
            let memory = estimate::memory_mib(&source.policy.graph, 0);
            let inputs = source.with([source.heldout.clone()]);
            row.evaluations.push(self.add(title, Work::Evaluate(evaluate), inputs, (1, memory, seconds))?);
        }
        if let Some(drive) = &self.spec.drive {
            for seeds in ranges(drive.first_seed, drive.episodes, drive.per_job) {
                let title = format!("{title}: drive seeds {}", range(seeds));
                row.drives.push(self.drive(source, title, &row.image, drive, seeds, false)?);
            }
        }
        self.rows.push(row);
        Ok(())
    }

    fn drive(
        &mut self,
        source: &Source,
        title: String,
        image: &str,
        drive: &spec::Drive,
        seeds: Episodes,
        record: bool,
    ) -> Result<String> {
        ensure!(
            source.policy.around.is_none(),
            "[drive] does not support policies with a deploy.toml yet; remove [drive], or the policy"
        );
        let work = Work::Drive(Drive {
            image: image.to_owned(),
            policy: Some(source.path.clone()),
            folder: drive.folder.clone(),
            command: drive.command.clone(),
            seeds,
            record,
        });
        let files = drive.files.iter().map(|file| Input::of(Role::Command, file.clone()));
        let inputs = source.with(files.collect::<Result<Vec<_>>>()?);
        self.add(title, work, inputs, (drive.cpus, drive.memory_mib, drive.seconds * seeds.count as f64))
    }
}

/// Divides episodes into ranges of at most `per_job`.
fn ranges(first: u64, count: u64, per_job: Option<u64>) -> impl Iterator<Item = Episodes> {
    let most = per_job.unwrap_or(count).max(1);
    (0..count.div_ceil(most)).map(move |i| {
        let before = i * most;
        Episodes { first: first + before, count: most.min(count - before) }
    })
}

fn range(episodes: Episodes) -> String {
    format!("{} to {}", episodes.first, episodes.first + episodes.count.max(1) - 1)
}
