//! The simulators that drive a policy in its own task.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq::pipeline::driven::DriveOutcome;
use actq::runtime::{ImageBuffer, with_head};
use actq::text::quoted;
use actq_bench::closed_loop::episode_on_host;
use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::summary::summary;
use actq_ur3::task::{Outcome, run_episode};
use anyhow::{Context as _, Result, ensure};

use super::plan::UR3;

/// The driven policy.
#[derive(Clone, Debug)]
pub(super) enum Driver {
    /// An image, by the executor.
    Image(PathBuf),
    /// The f32 policy in a folder.
    Folder(PathBuf),
}

/// A task's simulator.
#[derive(Clone, Debug)]
pub(super) enum Simulator {
    /// In this process.
    Ur3,
    /// evaluate.py in a folder, run by a Python.
    MuJoCo { python: PathBuf, folder: PathBuf, task: String },
    /// No simulator, with the reason.
    Missing(String),
}

/// A range of episodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Episodes {
    pub(super) first: u64,
    pub(super) count: u64,
}

impl Simulator {
    /// Returns the simulator of a policy, whose shared folder is `shared`.
    pub(super) fn of(policy: &str, shared: Option<&Path>) -> Self {
        let Some(shared) = shared.filter(|_| policy != UR3) else { return Self::Ur3 };
        let variable = if policy.starts_with("fetch_") { "ACTQ_GYMNASIUM_PYTHON" } else { "ACTQ_MUJOCO_PYTHON" };
        let folder = shared.join("closed_loop");
        match std::env::var_os(variable).filter(|python| !python.is_empty()) {
            _ if !folder.join("evaluate.py").is_file() => {
                Self::Missing(format!("{} is missing", folder.join("evaluate.py").display()))
            }
            None => Self::Missing(format!("set {variable} to the Python that has its simulator")),
            Some(python) => Self::MuJoCo { python: program(python.into()), folder, task: policy.to_owned() },
        }
    }

    /// Drives the policy, with the command `actq` if needed; returns `None` without a simulator.
    pub(super) fn run(&self, driver: &Driver, episodes: Episodes, actq: &Path) -> Result<Option<DriveOutcome>> {
        match self {
            Self::Ur3 => ur3(driver, episodes).map(Some),
            Self::MuJoCo { python, folder, task } => {
                let mut command = Command::new(python);
                let [count, first] = [episodes.count, episodes.first].map(|number| number.to_string());
                command.current_dir(folder).args(["evaluate.py", task, "--episodes", &count, "--seed0", &first]);
                // One thread: a step of a small network gains nothing from more. Python must not leave a cache in the
                // folder.
                command.env("OMP_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1");
                match driver {
                    Driver::Image(image) => {
                        let words = [actq.as_os_str(), OsStr::new("serve"), image.as_os_str()];
                        let words = words.into_iter().map(quoted).collect::<Result<Vec<_>, _>>()?;
                        command.args(["--policy", "pipe_policy:factory"]).env("POLICY_CMD", words.join(" "));
                    }
                    Driver::Folder(policy) => {
                        command.args(["--bits", "32", "--dir"]).arg(policy);
                    }
                }
                evaluate(command).map(Some)
            }
            Self::Missing(_) => Ok(None),
        }
    }
}

/// Returns the folder of the shared policies, if there is one.
pub(super) fn shared() -> Result<Option<PathBuf>> {
    let folder = std::env::var_os("ACTQ_SHARED").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    let absolute =
        |path: PathBuf| std::fs::canonicalize(&path).with_context(|| format!("cannot read {}", path.display()));
    folder.map(absolute).transpose()
}

/// Resolves a program to run from another folder: a path becomes absolute, a name is searched for as a shell does.
/// Links stay, because the Python of a virtual environment finds itself by them.
fn program(name: PathBuf) -> PathBuf {
    if name.components().count() > 1 { std::path::absolute(&name).unwrap_or(name) } else { name }
}

fn ur3(driver: &Driver, episodes: Episodes) -> Result<DriveOutcome> {
    let mut seeds = episodes.first..episodes.first + episodes.count;
    let outcomes: Vec<Outcome> = match driver {
        Driver::Image(path) => {
            let buffer = ImageBuffer::read(path)?;
            with_head(buffer.image(path)?, |head| seeds.map(|seed| episode_on_host(head, seed)).collect())?
        }
        Driver::Folder(policy) => {
            let mut policy = PolicyF32::load(policy)?;
            let episode = |seed| {
                policy.reset();
                run_episode(seed, |obs| policy.act(obs))
            };
            seeds.by_ref().map(episode).collect()
        }
    };
    DriveOutcome::parse(&summary(&outcomes).to_string()).context("the summary of episodes is not an object")
}

/// Runs evaluate.py, which prints a line for every policy.
fn evaluate(mut command: Command) -> Result<DriveOutcome> {
    let output = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    let tail: Vec<&str> = stderr.lines().rev().take(12).collect();
    let tail = tail.into_iter().rev().collect::<Vec<_>>().join("\n");
    ensure!(output.status.success(), "the simulator failed ({}): {command:?}\n{tail}", output.status);
    let lines = String::from_utf8_lossy(&output.stdout).into_owned();
    let outcome = lines.lines().rev().find_map(|line| DriveOutcome::parse(line).filter(|o| o.success().is_some()));
    outcome.with_context(|| format!("the simulator printed no line with a success: {command:?}\n{tail}"))
}
