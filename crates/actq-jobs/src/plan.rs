//! The jobs of a spec.

use std::collections::BTreeMap;

use actq::budget::Budget;
use actq::data::Recording;
use actq::error::{Context as _, Result, bail, ensure};
use actq::methods::{Effort, Method};

use crate::estimate;
use crate::host::Host;
use crate::job::{Input, Job, Role, address};
use crate::order;
use crate::source::Source;
use crate::spec::{self, MAX_JOBS, Spec};
use crate::work::{Drive, Episodes, Evaluate, Learn, Make, Merge, Row, Work};

/// Returns the jobs of a spec, each after those that it depends on; the last one merges the results.
///
/// # Errors
///
/// If a policy, a recording or another file is missing or damaged; if a method is unknown; if two jobs would have one
/// address.
pub fn jobs(spec: &Spec, host: &dyn Host) -> Result<Vec<Job>> {
    spec.check()?;
    let files = spec.drive.iter().flat_map(|drive| &drive.files);
    let files = files.map(|file| Input::of(Role::Command, file.clone())).collect::<Result<_>>()?;
    let mut plan = Plan { spec, files, jobs: Jobs::default(), rows: Vec::new() };
    // Policies by their names, and their numbers among those of one name.
    let mut names: Vec<(String, usize)> = Vec::new();
    for path in &spec.policies {
        let source = Source::read(path, spec, host).with_context(|| path.display().to_string())?;
        let name = &source.policy.name;
        let same = names.iter().filter(|(known, _)| known == name).count();
        names.push((name.clone(), same + 1));
        for budget in spec.budgets() {
            for method in &spec.methods {
                for &seed in &spec.seeds {
                    plan.image(names.len() - 1, &source, make(spec, &source, method, budget, seed)?, host)?;
                }
            }
        }
    }
    let Plan { mut jobs, rows, .. } = plan;
    let named = |(name, number)| if number == 1 { name } else { format!("{name} ({number})") };
    let policies = names.into_iter().map(named).collect();
    let merge = Work::Merge(Merge { clock_hz: spec.clock, policies, rows });
    let seconds = estimate::merge_seconds(jobs.list.len());
    jobs.add("merge".to_owned(), merge, Vec::new(), (1, 64, seconds))?;
    jobs.finish()
}

/// Returns the first image of a combination.
fn make(spec: &Spec, source: &Source, name: &str, budget: Budget, seed: u64) -> Result<Make> {
    let matrices = &source.policy.graph.matrices;
    if let Some(name) = spec.widths.keys().find(|name| matrices.iter().all(|matrix| matrix.name != **name)) {
        let names: Vec<&str> = matrices.iter().map(|matrix| matrix.name.as_str()).collect();
        bail!("widths: {name}: {} has no such matrix; it has {}", source.policy.name, names.join(", "));
    }
    // The options of learning apply to distill alone.
    let learns = name == "distill";
    Ok(Make {
        policy: Some(source.path.clone()),
        method: name.to_owned(),
        budget,
        group: spec.group,
        activations: spec.activations,
        widths: if learns { spec.widths.clone() } else { Default::default() },
        steps: spec.steps.filter(|_| learns),
        effort: if learns { spec.effort } else { Effort::Default },
        relative: spec.relative && learns,
        seed,
    })
}

/// Estimates for a job: cores, memory in MiB, seconds.
pub type Size = (usize, u64, f64);

/// Jobs of a plan in the making, each after those that it depends on.
#[derive(Debug, Default)]
pub struct Jobs {
    list: Vec<Job>,
    /// Stages of the jobs, by their addresses.
    stages: BTreeMap<String, usize>,
}

impl Jobs {
    /// Adds a job after those that it depends on, and returns its address.
    ///
    /// # Errors
    ///
    /// If the job cannot be formatted, or the plan has [`MAX_JOBS`].
    pub fn add(&mut self, title: String, work: Work, inputs: Vec<Input>, size: Size) -> Result<String> {
        ensure!(self.list.len() < MAX_JOBS, "the plan has more than {MAX_JOBS} jobs; divide the spec");
        let address = address(&work, &inputs)?;
        let deps = work.deps();
        let stage = match work {
            // The merge depends on all.
            Work::Merge(_) => self.stages.values().max().map_or(0, |stage| stage + 1),
            _ => deps.iter().filter_map(|dep| self.stages.get(dep)).max().map_or(0, |stage| stage + 1),
        };
        let (cpus, memory_mib, seconds) = size;
        self.stages.insert(address.clone(), stage);
        self.list.push(Job { address: address.clone(), title, work, inputs, deps, stage, cpus, memory_mib, seconds });
        Ok(address)
    }

    /// Returns the jobs.
    ///
    /// # Errors
    ///
    /// If two of them have one address.
    pub fn finish(self) -> Result<Vec<Job>> {
        order::check(&self.list)?;
        Ok(self.list)
    }
}

struct Plan<'a> {
    spec: &'a Spec,
    /// Files that the drive command depends on.
    files: Vec<Input>,
    jobs: Jobs,
    rows: Vec<Row>,
}

impl Plan<'_> {
    /// Adds an image with its measurements, and those of its on-policy rounds.
    fn image(&mut self, policy: usize, source: &Source, make: Make, host: &dyn Host) -> Result<()> {
        let (spec, graph) = (self.spec, &source.policy.graph);
        let method = host.method(&make.method)?;
        let name = make.method.clone();
        make.options(method.clone()).with_context(|| format!("method {name}"))?;
        let needs_calib = method != Method::Rtn;
        let calib: &[Input] = if needs_calib { &source.calib } else { &[] };
        ensure!(!needs_calib || !calib.is_empty(), "{}", Recording::Calib.missing(&name));
        let title = format!("{}, {name} at {}, seed {}", source.policy.name, make.budget, make.seed);
        let seconds = estimate::quantize_seconds(graph, &method, make.steps, make.effort);
        let recordings = if needs_calib { source.calib_bytes } else { 0 };
        let size = (spec.cpus, estimate::memory_mib(graph, recordings), seconds);
        // A search for an error measures it.
        let measured = Some(&source.heldout).filter(|_| matches!(make.budget, Budget::MaxNmse(_)));
        let inputs = source.with(calib.iter().chain(measured));
        let first = self.jobs.add(format!("{title}: quantize"), Work::Quantize(make.clone()), inputs.clone(), size)?;
        let row = |image: String, round| Row {
            policy,
            method: name.clone(),
            budget: make.budget,
            seed: make.seed,
            round,
            image,
            evaluations: Vec::new(),
            drives: Vec::new(),
        };
        self.measure(source, &title, row(first.clone(), 0))?;
        let Some((learn, drive)) = spec.learn.as_ref().zip(spec.drive.as_ref()).filter(|_| method == Method::Distill)
        else {
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
            image = self.jobs.add(format!("{title}: learn again"), work, inputs.clone(), size)?;
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
            let seconds = estimate::evaluate_seconds(&source.policy.graph, part.iter().sum());
            let memory = estimate::memory_mib(&source.policy.graph, 0);
            let inputs = source.with([&source.heldout]);
            row.evaluations.push(self.jobs.add(title, Work::Evaluate(evaluate), inputs, (1, memory, seconds))?);
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
        let inputs = source.with(&self.files);
        self.jobs.add(title, work, inputs, (drive.cpus, drive.memory_mib, drive.seconds * seeds.count as f64))
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
