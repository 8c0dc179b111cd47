//! `cargo xtask exporters`: policies that released packages export, against their import.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq_boards::{root, target_dir};
use anyhow::{Context as _, Result, ensure};
use clap::Args;

use crate::PROFILE;
use crate::python::{interpreter, run};

/// Requirements that all environments share: torch is large.
const SHARED: [&str; 6] =
    ["maturin==1.16.0", "numpy==2.4.6", "onnx==1.23.2", "onnxruntime==1.32.0", "onnxscript==0.7.2", "torch==2.15.0"];

/// Name, releases, and releases that are installed without what they require: pins of other releases, or simulators.
type Package = (&'static str, &'static [&'static str], &'static [&'static str]);

/// Functions of `tools/exporters/exporters.py` with the releases that each needs.
const PACKAGES: [Package; 18] = [
    ("torch", &[], &[]),
    ("stable_baselines3", &["stable-baselines3==2.9.2", "sb3-contrib==2.9.2"], &[]),
    ("rsl_rl", &["rsl-rl-lib==5.5.1"], &[]),
    ("skrl", &["skrl==2.1.1"], &[]),
    ("rl_games", &["rl-games==1.6.5"], &[]),
    ("torchrl", &["torchrl==0.14.0"], &[]),
    ("tianshou", &["tianshou==2.0.0"], &[]),
    ("torchao", &["torchao==0.18.0"], &[]),
    ("keras", &["keras==3.15.0"], &[]),
    // flax 0.12.8 cannot be imported with later releases of jax, which it allows.
    ("jax2onnx", &["jax2onnx==0.17.0", "flax==0.12.8", "jax==0.10.2", "jaxlib==0.10.2"], &[]),
    ("onnxruntime", &[], &[]),
    ("optimizers", &["onnxslim==0.1.98", "onnxsim==0.8.1", "onnxoptimizer==0.4.2"], &[]),
    ("lerobot", LEROBOT, &["lerobot==0.6.1"]),
    ("kinfer", &[], &["kinfer==0.6.1"]),
    ("leapp", &["leapp==0.7.2"], &[]),
    ("mjlab", &["mjlab==1.6.0"], &[]),
    ("holosoma", HOLOSOMA, &["holosoma==0.0.3"]),
    // Python 3.12 only.
    ("isaaclab", ISAACLAB, &["isaaclab==3.0.0"]),
];

/// The packages that LeRobot's policies and processors import; the package itself pins an older torch.
const LEROBOT: &[&str] = &[
    "draccus==0.11.6",
    "einops==0.8.1",
    "gymnasium==1.3.0",
    "huggingface-hub==1.6.0",
    "opencv-python-headless==4.13.0.92",
    "safetensors==0.8.0",
    "torchvision==0.29.2",
];

/// The packages that holosoma's observation manager and exporter import; the package itself requires an older numpy.
const HOLOSOMA: &[&str] = &[
    "loguru==0.7.3",
    "omegaconf==2.4.0",
    "pydantic==2.14.4",
    "scipy==1.17.1",
    "tensorboard==2.21.0",
    "tensordict==0.15.3",
    "trimesh==5.2.0",
    "tyro==1.0.17",
];

/// The packages that Isaac Lab's managers import; the package itself pins an older torch, and simulators.
const ISAACLAB: &[&str] =
    &["gymnasium==1.4.0", "lazy_loader==0.6", "prettytable==3.18.0", "pyyaml==6.0.4", "warp-lang==1.17.0"];

/// The request.
#[derive(Args)]
pub(crate) struct Options {
    /// Packages to run; the default is all
    #[arg(value_parser = PACKAGES.map(|(name, ..)| name))]
    packages: Vec<String>,
}

/// Runs each package in an environment of its own, prints its rows (package | kind | form | outcome | error of the actions),
/// and compares them with `tools/exporters/expected.txt`. Environment variable `UPDATE_EXPECT` rewrites that file.
pub(crate) fn compare(Options { packages }: Options) -> Result<()> {
    let folder = target_dir().join("exporters");
    let shared = environment(&folder.join("shared"), None)?;
    run(pip(&shared).args(SHARED))?;
    let wheels = folder.join("wheels");
    let build = ["-m", "maturin", "build", "--profile", PROFILE, "--locked", "--out"];
    run(Command::new(&shared).current_dir(root().join("python")).args(build).arg(&wheels))?;
    run(pip(&shared).args(["--force-reinstall", "--no-deps", "--no-index", "--find-links"]).arg(&wheels).arg("actq"))?;
    let file = root().join("tools/exporters/expected.txt");
    let expected = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
    let (mut rows, mut wrong, mut table) = (Vec::new(), Vec::new(), Vec::new());
    for (name, releases, alone) in PACKAGES {
        let before = expected.lines().filter(|row| row.split(" | ").next() == Some(name)).map(str::to_owned);
        if !packages.is_empty() && !packages.iter().any(|package| package == name) {
            rows.extend(before);
            continue;
        }
        let release = [releases, alone].concat().join(", ");
        let python = environment(&folder.join(name), Some(&folder.join("shared")))?;
        let is_installed = releases.is_empty() || run(pip(&python).args(releases)).is_ok();
        if !is_installed || !alone.is_empty() && run(pip(&python).arg("--no-deps").args(alone)).is_err() {
            table.push(format!("{name} | {release} | cannot be installed: skipped"));
            rows.extend(before);
            continue;
        }
        let found = outcomes(&python, name)?;
        wrong.extend(found.iter().filter(|row| row.contains(WRONG)).cloned());
        table.push(format!("{name} | {release} | {}", counted(&found)));
        rows.extend(found.iter().map(|row| row.rsplit_once(" | ").map_or(&**row, |(row, _)| row).to_owned()));
    }
    println!("\npackage | releases | outcomes\n{}", table.join("\n"));
    ensure!(wrong.is_empty(), "imported, but with other actions:\n{}", wrong.join("\n"));
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        return fs::write(&file, rows.join("\n") + "\n").with_context(|| file.display().to_string());
    }
    let package = |row: &str| row.split(" | ").next().unwrap_or_default().to_owned();
    let recorded: BTreeSet<String> = expected.lines().map(package).collect();
    // Of a package without a row, any outcome is new.
    let known = rows.iter().filter(|row| recorded.contains(&package(row)));
    let new = known.filter(|row| !expected.lines().any(|line| line == *row)).map(|row| format!("+ {row}"));
    let old = expected.lines().filter(|line| !rows.iter().any(|row| row == line)).map(|line| format!("- {line}"));
    let changes: Vec<String> = old.chain(new).collect();
    ensure!(changes.is_empty(), "other outcomes than in {}:\n{}", file.display(), changes.join("\n"));
    Ok(())
}

/// The script's word for an import with other actions.
const WRONG: &str = " | WRONG | ";

/// Returns the rows that the script prints for a package.
fn outcomes(python: &Path, name: &str) -> Result<Vec<String>> {
    let script = root().join("tools/exporters/exporters.py");
    let output = Command::new(python).arg(script).arg(name).stderr(Stdio::inherit()).output();
    let output = output.with_context(|| format!("cannot start {}", python.display()))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let mut rows: Vec<String> =
        text.lines().filter(|row| row.contains(" | ")).map(|row| format!("{name} | {row}")).collect();
    if !output.status.success() {
        rows.push(format!("{name} | all | script | fails | "));
    }
    rows.iter().for_each(|row| println!("{row}"));
    Ok(rows)
}

/// Returns the number of rows by outcome, and the largest error of the imports.
fn counted(rows: &[String]) -> String {
    let mut counts = BTreeMap::<&str, usize>::new();
    let mut largest = 0_f64;
    for row in rows {
        let mut parts = row.rsplit(" | ");
        largest = parts.next().and_then(|size| size.parse().ok()).map_or(largest, |size: f64| size.max(largest));
        *counts.entry(parts.next().unwrap_or_default().split(':').next().unwrap_or_default()).or_default() += 1;
    }
    let counts: Vec<String> = counts.iter().map(|(outcome, count)| format!("{outcome} {count}")).collect();
    format!("{}; off by {largest:.0e} at most", counts.join(", "))
}

/// Makes a virtual environment, unless it exists with this interpreter, which also finds the packages of `beside`; returns its interpreter.
fn environment(folder: &Path, beside: Option<&Path>) -> Result<PathBuf> {
    let bin = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    let python = folder.join(bin);
    let base = interpreter().map_err(anyhow::Error::msg)?;
    // Another interpreter needs other packages.
    let (stamp, name) = (folder.join("interpreter"), base.display().to_string());
    if fs::read_to_string(&stamp).unwrap_or_default() != name {
        run(Command::new(base).args(["-m", "venv", "--clear"]).arg(folder))?;
        fs::write(&stamp, name).with_context(|| stamp.display().to_string())?;
    }
    if let Some(beside) = beside {
        let [own, shared] = [site_packages(&python)?, site_packages(&beside.join(bin))?];
        let file = own.join("shared.pth");
        fs::write(&file, format!("{}\n", shared.display())).with_context(|| file.display().to_string())?;
    }
    Ok(python)
}

fn site_packages(python: &Path) -> Result<PathBuf> {
    let script = "import sysconfig; print(sysconfig.get_path('purelib'))";
    let output = Command::new(python).args(["-c", script]).output().with_context(|| python.display().to_string())?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().into())
}

fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    command
}
