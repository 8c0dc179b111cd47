//! The comparison: every method at every budget on every policy, each image in its own task.
//!
//! One thread quantizes, as learning uses all cores; another drives the finished images, and appends the results to the
//! journal.

mod actquant_k;
mod cell;
mod journal;
mod making;
mod pace;
mod plan;
mod report;
mod simulator;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};
use std::{env, fs};

use actq_bench::{command, ur3};
use actq_cli::outputs::files;
use actq_cli::report::progress::duration;
use anyhow::{Context as _, Result, anyhow, ensure};

pub use cell::{Cell, CellKey, Made};
pub use journal::{Header, Journal};
use making::{Attempt, Maker, Subject};
use plan::UR3;
pub use plan::{Contender, Plan};
use simulator::{Driver, Episodes, Simulator};

/// The least time between two progress lines of a slow cell.
const BETWEEN_LINES: Duration = Duration::from_secs(60);

/// A policy of the comparison.
struct Entrant {
    name: String,
    folder: PathBuf,
    simulator: Simulator,
}

/// A cell that was made, or is impossible, and the policy to drive.
struct Job {
    cell: Cell,
    driver: Option<Driver>,
    simulator: Simulator,
}

/// Runs the cells of the plan that the journal lacks, and writes the report.
///
/// # Errors
/// Reports failed cells at the end, after all others are made. The same plan run again retries them.
pub fn run(plan: &Plan) -> Result<()> {
    if !plan.report {
        compare(plan)?;
    }
    let path = report::write(&Journal::read(&plan.out)?, &plan.out)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

fn compare(plan: &Plan) -> Result<()> {
    let entrants = entrants(plan)?;
    let journal = Journal::open(plan)?;
    let all: Vec<(CellKey, &Entrant)> =
        entrants.iter().flat_map(|entrant| keys(plan, &entrant.name).map(move |key| (key, entrant))).collect();
    let is_done = |(key, entrant): &(CellKey, &Entrant)| {
        // If a simulator has been added since, repeat the cells that were not driven.
        let drivable = !matches!(entrant.simulator, Simulator::Missing(_));
        journal.find(key).is_some_and(|cell| cell.driven.is_some() || cell.why.is_some() || !drivable)
    };
    let missing: Vec<(CellKey, &Entrant)> = all.iter().filter(|cell| !is_done(cell)).cloned().collect();
    eprintln!("{} of {} cells are done, {} remain", all.len() - missing.len(), all.len(), missing.len());
    if missing.is_empty() {
        return Ok(());
    }
    let images = absolute(&plan.out)?.join("images");
    fs::create_dir_all(&images).with_context(|| format!("cannot create {}", images.display()))?;
    // A rebuild of the command must not affect a run of hours.
    let private = tempfile::tempdir().context("cannot create a temporary folder")?;
    let mut actq = PathBuf::new();
    if missing.iter().any(|(_, entrant)| matches!(entrant.simulator, Simulator::MuJoCo { .. })) {
        actq = private.path().join(format!("actq{}", env::consts::EXE_SUFFIX));
        fs::copy(command::binary()?, &actq).context("cannot copy the command actq")?;
    }

    let status = Status { journal: Mutex::new(journal), keys: missing.iter().map(|(key, _)| key.clone()).collect() };
    let mut failures = Vec::new();
    thread::scope(|scope| -> Result<()> {
        let (to_drive, jobs) = channel::<Job>();
        let (status, actq) = (&status, &actq);
        let driving = scope.spawn(move || drive(plan, jobs, actq, status));
        let mut groups: BTreeMap<&str, Vec<&CellKey>> = BTreeMap::new();
        for (key, entrant) in &missing {
            groups.entry(&entrant.name).or_default().push(key);
        }
        'policies: for entrant in &entrants {
            let Some(keys) = groups.get(entrant.name.as_str()) else { continue };
            let subject = Subject::load(&entrant.folder)?;
            let mut maker = Maker::new(&subject, plan);
            for key in keys {
                match make(key, entrant, &mut maker, &images) {
                    Ok(job) => {
                        if to_drive.send(job).is_err() {
                            // The other thread has ended, and reports why.
                            break 'policies;
                        }
                    }
                    Err(error) => failures.push(failed(key, &error)),
                }
            }
        }
        drop(to_drive);
        failures.extend(driving.join().map_err(|_| anyhow!("the driving thread panicked"))??);
        Ok(())
    })?;
    if !failures.is_empty() {
        // The finished cells are worth a report all the same.
        report::write(&Journal::read(&plan.out)?, &plan.out)?;
    }
    ensure!(
        failures.is_empty(),
        "{} cells failed; the same command retries them:\n{}",
        failures.len(),
        failures.join("\n")
    );
    Ok(())
}

/// Returns the policies of a plan that are present.
fn entrants(plan: &Plan) -> Result<Vec<Entrant>> {
    let shared = env::var_os("ACTQ_SHARED").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    let shared = shared.as_deref().map(absolute).transpose()?;
    let mut entrants = Vec::new();
    for name in &plan.policies {
        let simulator = Simulator::of(name, shared.as_deref());
        let folder = match &shared {
            _ if name == UR3 => ur3(),
            Some(shared) => shared.join("policies").join(name),
            None => {
                eprintln!("{name} is excluded: set ACTQ_SHARED to the folder of the shared policies");
                continue;
            }
        };
        ensure!(
            folder.join("policy.json").is_file(),
            "{}: holds no policy.json; --policies takes ur3 and folders under $ACTQ_SHARED/policies",
            folder.display()
        );
        if let Simulator::Missing(why) = &simulator {
            eprintln!("{name} is not driven: {why}");
        }
        entrants.push(Entrant { name: name.clone(), folder, simulator });
    }
    ensure!(!entrants.is_empty(), "no policy is left: set ACTQ_SHARED, or add ur3 to --policies");
    Ok(entrants)
}

/// Returns the cells of a policy: itself, then every method at every budget.
fn keys<'a>(plan: &'a Plan, policy: &'a str) -> impl Iterator<Item = CellKey> + 'a {
    let key = move |method, budget| CellKey { policy: policy.to_owned(), method, budget };
    let rows = plan.methods.iter().flat_map(|&method| plan.budgets.iter().map(move |&budget| (method, budget)));
    std::iter::once(key(None, None)).chain(rows.map(move |(method, budget)| key(Some(method), Some(budget))))
}

fn make(key: &CellKey, entrant: &Entrant, maker: &mut Maker<'_>, images: &Path) -> Result<Job> {
    let mut cell = Cell { key: key.clone(), made: None, why: None, driven: None, drive_seconds: 0.0 };
    let simulator = entrant.simulator.clone();
    let (Some(method), Some(budget)) = (key.method, key.budget) else {
        return Ok(Job { cell, driver: Some(Driver::Folder(entrant.folder.clone())), simulator });
    };
    let mut reported_at = Instant::now();
    let attempt = maker.make(method, budget, |work, share| {
        if reported_at.elapsed() >= BETWEEN_LINES {
            eprintln!("  {}: {work}, {:.0}%", key.title(), 100.0 * share);
            reported_at = Instant::now();
        }
    })?;
    let driver = match attempt {
        Attempt::Made(image, made) => {
            let path = images.join(format!("{}-{}-{budget}.actq", key.policy, method.name()));
            files::write(&path, &image)?;
            cell.made = Some(made);
            Some(Driver::Image(path))
        }
        Attempt::Simulated(graph, made) => {
            let folder = images.join(format!("{}-{}-{budget}", key.policy, method.name()));
            actquant_k::write_policy(maker.policy(), &graph, &folder)?;
            cell.made = Some(made);
            Some(Driver::Folder(folder))
        }
        Attempt::Impossible(why) => {
            cell.why = Some(why);
            None
        }
    };
    Ok(Job { cell, driver, simulator })
}

/// The state that both threads share.
struct Status {
    journal: Mutex<Journal>,
    /// The cells that this run must make.
    keys: Vec<CellKey>,
}

impl Status {
    fn journal(&self) -> MutexGuard<'_, Journal> {
        // After a panic elsewhere the journal still has whole lines.
        self.journal.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Appends a cell, and prints its result and the remaining time.
    fn add(&self, cell: Cell) -> Result<()> {
        let title = cell.key.title();
        let what = report::sentence(&cell);
        let mut journal = self.journal();
        journal.add(cell)?;
        let missing: Vec<CellKey> = self.keys.iter().filter(|key| journal.find(key).is_none()).cloned().collect();
        let left = pace::seconds_left(&journal.cells, &missing).unwrap_or_default();
        let (done, all) = (self.keys.len() - missing.len(), self.keys.len());
        eprintln!("[{done}/{all}] {title}: {what}; about {} left", duration(left));
        Ok(())
    }
}

/// Drives jobs until the channel closes. Returns the failures.
fn drive(plan: &Plan, jobs: Receiver<Job>, actq: &Path, status: &Status) -> Result<Vec<String>> {
    let episodes = Episodes { first: plan.seed0, count: plan.episodes };
    let mut failures = Vec::new();
    for Job { mut cell, driver, simulator } in jobs {
        let begun = Instant::now();
        let outcome = driver.map_or(Ok(None), |driver| simulator.run(&driver, episodes, actq));
        match outcome {
            Ok(outcome) => {
                cell.driven = outcome.map(serde_json::to_value).transpose()?;
                cell.drive_seconds = begun.elapsed().as_secs_f64();
                status.add(cell)?;
            }
            Err(error) => failures.push(failed(&cell.key, &error)),
        }
    }
    Ok(failures)
}

/// Reports a failed cell immediately, and returns the message for the end.
fn failed(key: &CellKey, error: &anyhow::Error) -> String {
    let message = format!("{}: {error:#}", key.title());
    eprintln!("FAILED {message}");
    message
}

fn absolute(path: &Path) -> Result<PathBuf> {
    fs::canonicalize(path).with_context(|| format!("cannot read {}", path.display()))
}
