//! `cargo xtask exporters`: policies that released packages export, against their import.

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

/// Functions of `tools/exporters/exporters.py` with the releases that each needs.
const PACKAGES: [(&str, &[&str]); 10] = [
    ("torch", &[]),
    ("stable_baselines3", &["stable-baselines3==2.9.2"]),
    ("rsl_rl", &["rsl-rl-lib==5.5.1"]),
    ("skrl", &["skrl==2.1.1"]),
    ("rl_games", &["rl-games==1.6.5"]),
    ("torchrl", &["torchrl==0.14.0"]),
    ("tianshou", &["tianshou==2.0.0"]),
    ("torchao", &["torchao==0.18.0"]),
    ("keras", &["keras==3.15.0"]),
    ("jax2onnx", &["jax2onnx==0.17.0", "flax==0.12.8"]),
];

/// The request.
#[derive(Args)]
pub(crate) struct Options {
    /// Packages to run; the default is all
    #[arg(value_parser = PACKAGES.map(|(name, _)| name))]
    packages: Vec<String>,
}

/// Installs each package in an environment of its own, and prints its rows: package | kind | form | outcome.
pub(crate) fn compare(Options { packages }: Options) -> Result<()> {
    let folder = target_dir().join("exporters");
    let shared = environment(&folder.join("shared"), None)?;
    run(pip(&shared).args(SHARED))?;
    let wheels = folder.join("wheels");
    let build = ["-m", "maturin", "build", "--profile", PROFILE, "--locked", "--out"];
    run(Command::new(&shared).current_dir(root().join("python")).args(build).arg(&wheels))?;
    run(pip(&shared).args(["--force-reinstall", "--no-deps", "--no-index", "--find-links"]).arg(&wheels).arg("actq"))?;
    let mut wrong = Vec::new();
    for (name, releases) in PACKAGES {
        if !packages.is_empty() && !packages.iter().any(|package| package == name) {
            continue;
        }
        let python = environment(&folder.join(name), Some(&folder.join("shared")))?;
        if !releases.is_empty() && run(pip(&python).args(releases)).is_err() {
            println!("{name} | | {} | not installable", releases.join(" "));
            continue;
        }
        let script = root().join("tools/exporters/exporters.py");
        let output = Command::new(&python).arg(script).arg(name).stderr(Stdio::inherit()).output();
        let output = output.with_context(|| format!("cannot start {}", python.display()))?;
        let rows = String::from_utf8_lossy(&output.stdout).into_owned();
        rows.lines().filter(|row| row.contains(" | ")).for_each(|row| println!("{name} | {row}"));
        ensure!(output.status.success(), "{name}: the script failed");
        wrong.extend(rows.lines().filter(|row| row.contains("WRONG")).map(|row| format!("{name} | {row}")));
    }
    ensure!(wrong.is_empty(), "imported, but with other actions:\n{}", wrong.join("\n"));
    Ok(())
}

/// Makes a virtual environment, unless it exists, which also finds the packages of `beside`; returns its interpreter.
fn environment(folder: &Path, beside: Option<&Path>) -> Result<PathBuf> {
    let bin = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    let python = folder.join(bin);
    if !python.is_file() {
        let base = interpreter().map_err(anyhow::Error::msg)?;
        run(Command::new(base).args(["-m", "venv", "--clear"]).arg(folder))?;
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
