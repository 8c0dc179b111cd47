//! The comparison: every method at every budget on every policy, each image made by one job and driven by another.

mod actquant_k;
mod cell;
mod cell_image;
mod jobs;
mod least;
mod limits;
mod plan;
mod report;
mod results;
mod simulator;
mod work;

use std::{env, fs};

use actq_bench::{command, ur3};
use actq_cli::commands::jobs::host::Command;
use actq_cli::commands::jobs::pool::{Pool, complete};
use actq_cli::outputs::files;
use actq_jobs::order;
use actq_jobs::store::Store;
use anyhow::{Context as _, Result, ensure};

pub use cell::{Cell, CellKey, Made};
use jobs::Entrant;
pub use limits::Limit;
use plan::UR3;
pub use plan::{Contender, Plan};
use results::{HEADER, LOG, PLAN, STORE};
pub use results::{Header, Results};
use simulator::{Simulator, shared};
pub use work::work;

/// Most tries of a job in one run.
const TRIES: usize = 2;

/// Runs the jobs of the plan that have no result yet, and writes the report.
///
/// # Errors
/// Reports failed jobs at the end, after all others have run. The same plan run again retries them.
pub fn run(plan: &Plan) -> Result<()> {
    let outcome = if plan.report { Ok(()) } else { compare(plan) };
    // The finished cells are worth a report even if others failed.
    if plan.out.join(PLAN).is_file() || outcome.is_ok() {
        let path = report::write(&Results::read(&plan.out)?, &plan.out)?;
        eprintln!("wrote {}", path.display());
    }
    outcome
}

fn compare(plan: &Plan) -> Result<()> {
    let entrants = entrants(plan)?;
    let jobs = jobs::jobs(plan, &entrants)?;
    fs::create_dir_all(&plan.out).with_context(|| format!("cannot create {}", plan.out.display()))?;
    let header = serde_json::to_string_pretty(&Header::now(plan)?)? + "\n";
    files::write(&plan.out.join(HEADER), header.as_bytes())?;
    files::write(&plan.out.join(PLAN), order::text(&jobs)?.as_bytes())?;
    let store = Store::open(&plan.out.join(STORE), &Command)?;
    let left = jobs.iter().filter(|job| !store.has(&job.address)).count();
    eprintln!("{} of {} jobs are done, {left} remain", jobs.len() - left, jobs.len());
    if left == 0 {
        return Ok(());
    }
    // A rebuild of the commands must not affect a run of hours.
    let private = tempfile::tempdir().context("cannot create a temporary folder")?;
    let copy = |program: &std::path::Path, name: &str| {
        let to = private.path().join(format!("{name}{}", env::consts::EXE_SUFFIX));
        fs::copy(program, &to).with_context(|| format!("cannot copy the command {name}"))?;
        anyhow::Ok(to)
    };
    let program = copy(&env::current_exe().context("cannot find the running executable")?, "actq-research")?;
    if entrants.iter().any(|entrant| matches!(entrant.simulator, Simulator::MuJoCo { .. })) {
        copy(command::binary()?, "actq")?;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let log = plan.out.join(LOG);
    let pool = Pool { program: &program, cores, tries: TRIES, log: Some(&log), quiet: false, is_kept: true };
    complete(&jobs, &store, &pool)
}

/// Returns the policies of a plan that are present.
fn entrants(plan: &Plan) -> Result<Vec<Entrant>> {
    let shared = shared()?;
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
