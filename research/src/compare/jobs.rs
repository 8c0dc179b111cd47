//! The jobs of a comparison: one that makes each image, and one that drives it.

use std::path::PathBuf;

use actq::data::Recording;
use actq::import::FILES;
use actq::methods::Effort;
use actq::policy::Policy;
use actq_jobs::estimate;
use actq_jobs::job::{Input, Job, Role};
use actq_jobs::plan::Jobs;
use actq_jobs::work::{Custom, Work};
use anyhow::{Context as _, Result};
use serde::{Deserialize, Serialize};

use super::cell::CellKey;
use super::limits::Limit;
use super::plan::{Contender, Plan};
use super::simulator::Simulator;

/// Names of the works.
pub(super) const MAKE: &str = "compare: make";
pub(super) const DRIVE: &str = "compare: drive";

/// Number of this crate's methods, part of the address of what they make. It is raised whenever one of them gives other
/// images than before, as [`actq::pipeline::REVISION`] is for the library's.
const REVISION: u32 = 2;

/// Estimated seconds of an episode.
const EPISODE: f64 = 0.5;

/// A policy of the comparison.
pub(super) struct Entrant {
    pub(super) name: String,
    pub(super) folder: PathBuf,
    pub(super) simulator: Simulator,
}

/// Options of a job that makes an image.
#[derive(Serialize, Deserialize)]
pub(super) struct Making {
    policy: String,
    pub(super) method: Contender,
    pub(super) budget: Limit,
    pub(super) steps: Option<usize>,
    pub(super) seed: u64,
    revision: u32,
}

/// Options of a job that drives an image, or without one the f32 policy.
#[derive(Serialize, Deserialize)]
pub(super) struct Driving {
    pub(super) policy: String,
    pub(super) first: u64,
    pub(super) count: u64,
}

/// A cell's jobs, by their addresses; the f32 policy has no image, and without a simulator nothing drives it.
#[derive(Clone, Debug, Default)]
pub(super) struct CellJobs {
    pub(super) make: Option<String>,
    pub(super) drive: Option<String>,
}

/// Returns the jobs of a comparison: of each policy itself, then of every method at every budget.
pub(super) fn jobs(plan: &Plan, entrants: &[Entrant]) -> Result<Vec<Job>> {
    let mut jobs = Jobs::default();
    for entrant in entrants {
        let folder = &entrant.folder;
        let policy = Policy::load(folder)?;
        let files = FILES.map(|name| Input::of(Role::Policy, folder.join(name)));
        let files: Vec<Input> = files.into_iter().collect::<actq::error::Result<_>>()?;
        let mut recordings = Vec::new();
        for (recording, role) in [(Recording::Calib, Role::Calib), (Recording::Heldout, Role::Heldout)] {
            recordings.extend(recording.find(folder)?.map(|file| Input::of(role, file)).transpose()?);
        }
        let memory = estimate::memory_mib(&policy.graph, 0);
        let drive = |jobs: &mut Jobs, key: &CellKey, needs: Vec<String>| -> Result<()> {
            if matches!(entrant.simulator, Simulator::Missing(_)) {
                return Ok(());
            }
            let driving = Driving { policy: entrant.name.clone(), first: plan.seed0, count: plan.episodes };
            let work = Custom { name: DRIVE.to_owned(), options: serde_json::to_value(driving)?, needs };
            let size = (1, memory, EPISODE * plan.episodes as f64);
            jobs.add(format!("{}: drive", key.title()), Work::Custom(work), files.clone(), size)?;
            Ok(())
        };
        drive(&mut jobs, &CellKey { policy: entrant.name.clone(), method: None, budget: None }, Vec::new())?;
        for &method in &plan.methods {
            for &budget in &plan.budgets {
                let key = CellKey { policy: entrant.name.clone(), method: Some(method), budget: Some(budget) };
                let making = Making {
                    policy: entrant.name.clone(),
                    method,
                    budget,
                    steps: plan.steps,
                    seed: plan.seed,
                    revision: REVISION,
                };
                let work = Custom { name: MAKE.to_owned(), options: serde_json::to_value(making)?, needs: Vec::new() };
                let steps = if method == Contender::DistillNotLearned { Some(0) } else { plan.steps };
                let seconds = estimate::quantize_seconds(&policy.graph, &method.method(), steps, Effort::Default);
                let inputs = files.iter().chain(&recordings).cloned().collect();
                let title = format!("{}: make", key.title());
                let made = jobs.add(title, Work::Custom(work), inputs, (1, memory, seconds))?;
                if method.is_driven() {
                    drive(&mut jobs, &key, vec![made])?;
                }
            }
        }
    }
    Ok(jobs.finish()?)
}

/// Returns the cells of a plan's jobs, in their order.
pub(super) fn cells(jobs: &[Job]) -> Result<Vec<(CellKey, CellJobs)>> {
    let mut cells: Vec<(CellKey, CellJobs)> = Vec::new();
    for job in jobs {
        let Work::Custom(work) = &job.work else { continue };
        let options = work.options.clone();
        match (work.name.as_str(), &work.needs[..]) {
            (MAKE, _) => {
                let Making { policy, method, budget, .. } = serde_json::from_value(options)?;
                let key = CellKey { policy, method: Some(method), budget: Some(budget) };
                cells.push((key, CellJobs { make: Some(job.address.clone()), drive: None }));
            }
            (_, []) => {
                let Driving { policy, .. } = serde_json::from_value(options)?;
                let key = CellKey { policy, method: None, budget: None };
                cells.push((key, CellJobs { make: None, drive: Some(job.address.clone()) }));
            }
            (_, [made, ..]) => {
                let cell = cells.iter_mut().find(|(_, jobs)| jobs.make.as_ref() == Some(made));
                cell.with_context(|| job.title.clone())?.1.drive = Some(job.address.clone());
            }
        }
    }
    Ok(cells)
}
