//! The comparison: every method at every budget on every policy, each image in its own task.
//!
//! One thread quantizes, as learning uses all cores; another drives what was made before, and appends it to the
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

use actq_cli::outputs::files;
use anyhow::{Context as _, Result, anyhow, ensure};

use crate::{command, ur3};
pub use cell::{Cell, CellKey, Made};
pub use journal::{Header, Journal};
use making::{Attempt, Maker, Subject};
use plan::UR3;
pub use plan::{Contender, Plan};
use simulator::{Driver, Episodes, Simulator};

/// The least time between two lines about a cell that takes long.
const BETWEEN_LINES: Duration = Duration::from_secs(60);

/// A policy that takes part.
struct Entrant {
    name: String,
    folder: PathBuf,
    simulator: Simulator,
}

/// A cell that was made, or could not be, and what is to be driven of it.
struct Job {
    cell: Cell,
    driver: Option<Driver>,
    simulator: Simulator,
}

/// Runs what of the plan is not in the journal yet, and writes the report.
///
/// # Errors
/// What went wrong with a cell is told at the end; the others are made, and the same plan again tries it again.
pub fn run(plan: &Plan) -> Result<()> {
    if !plan.report {
        compare(plan)?;
    }
    let path = report::write(&Journal::read(&plan.out)?, &plan.out)?;
    eprintln!("{} is written", path.display());
    Ok(())
}

fn compare(plan: &Plan) -> Result<()> {
    let entrants = entrants(plan)?;
    let journal = Journal::open(plan)?;
    let all: Vec<(CellKey, &Entrant)> =
        entrants.iter().flat_map(|entrant| keys(plan, &entrant.name).map(move |key| (key, entrant))).collect();
    let is_done = |(key, entrant): &(CellKey, &Entrant)| {
        // Where a simulator has come since, what was not driven is made once more.
        let drivable = !matches!(entrant.simulator, Simulator::Missing(_));
        journal.find(key).is_some_and(|cell| cell.driven.is_some() || cell.why.is_some() || !drivable)
    };
    let missing: Vec<(CellKey, &Entrant)> = all.iter().filter(|cell| !is_done(cell)).cloned().collect();
    eprintln!("{} of {} cells are there, {} to be made", all.len() - missing.len(), all.len(), missing.len());
    if missing.is_empty() {
        return Ok(());
    }
    let images = absolute(&plan.out)?.join("images");
    fs::create_dir_all(&images).with_context(|| format!("{}: cannot be made", images.display()))?;
    // What a rebuild does to the command must not reach a run of hours.
    let private = tempfile::tempdir().context("no temporary folder can be made")?;
    let mut actq = PathBuf::new();
    if missing.iter().any(|(_, entrant)| matches!(entrant.simulator, Simulator::MuJoCo { .. })) {
        actq = private.path().join(format!("actq{}", env::consts::EXE_SUFFIX));
        fs::copy(command::binary()?, &actq).context("the command actq cannot be copied")?;
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
                            // The other thread has ended: it says why.
                            break 'policies;
                        }
                    }
                    Err(error) => failures.push(failed(key, &error)),
                }
            }
        }
        drop(to_drive);
        failures.extend(driving.join().map_err(|_| anyhow!("the thread that drives has panicked"))??);
        Ok(())
    })?;
    if !failures.is_empty() {
        // What is there is worth a report all the same.
        report::write(&Journal::read(&plan.out)?, &plan.out)?;
    }
    ensure!(
        failures.is_empty(),
        "{} cells have failed; the same command tries them again:\n{}",
        failures.len(),
        failures.join("\n")
    );
    Ok(())
}

/// The policies of a plan that are there.
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
                eprintln!("{name} is left out: ACTQ_SHARED is not set, which names the folder of the shared policies");
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

/// The cells of a policy: itself, then every method at every budget.
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
    let mut said = Instant::now();
    let attempt = maker.make(method, budget, |work, share| {
        if said.elapsed() >= BETWEEN_LINES {
            eprintln!("  {}: {work}, {:.0}%", key.title(), 100.0 * share);
            said = Instant::now();
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

/// What both threads look at.
struct Status {
    journal: Mutex<Journal>,
    /// The cells that this run is to make.
    keys: Vec<CellKey>,
}

impl Status {
    fn journal(&self) -> MutexGuard<'_, Journal> {
        // A panic elsewhere leaves whole lines.
        self.journal.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Appends a cell, and says what it holds and how long is left.
    fn add(&self, cell: Cell) -> Result<()> {
        let title = cell.key.title();
        let what = report::sentence(&cell);
        let mut journal = self.journal();
        journal.add(cell)?;
        let missing: Vec<CellKey> = self.keys.iter().filter(|key| journal.find(key).is_none()).cloned().collect();
        let left = pace::seconds_left(&journal.cells, &missing).unwrap_or_default();
        let (done, all) = (self.keys.len() - missing.len(), self.keys.len());
        eprintln!("[{done}/{all}] {title}: {what}; about {} left", pace::duration(left));
        Ok(())
    }
}

/// Drives what comes, until nothing comes any more. Gives what has failed.
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

/// Says that a cell has failed, at once and for the end.
fn failed(key: &CellKey, error: &anyhow::Error) -> String {
    let message = format!("{}: {error:#}", key.title());
    eprintln!("FAILED {message}");
    message
}

fn absolute(path: &Path) -> Result<PathBuf> {
    fs::canonicalize(path).with_context(|| format!("{}: cannot be read", path.display()))
}
