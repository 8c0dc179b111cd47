//! `cargo xtask python`: builds and tests the Python package in a virtual environment below the target directory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq_boards::{Clock, Target, root, target_dir, version};
use anyhow::{Context as _, Result, ensure};
use clap::Args;

use crate::setup::cargo;
use crate::{PROFILE, firmware};

/// The oldest supported version of Python.
const OLDEST: [u32; 2] = [3, 9];
/// The package, from the workspace's root.
const PACKAGE: &str = "python";
/// Requirements of the tests, and of those that only `--optional` runs.
const REQUIREMENTS: [&str; 2] = ["requirements-test.txt", "requirements-optional.txt"];

/// Board of the motor controller that the link's tests run in QEMU, and the range of its axes.
const BOARD: &str = "mps2-an386";
const LIMITS: &str = "-3:3";

/// The request.
#[derive(Args)]
pub(crate) struct Options {
    /// Also install torch, Stable-Baselines3 and Ray, and run the tests that need them
    #[arg(long)]
    optional: bool,
    /// Arguments for pytest, as -k head
    #[arg(last = true)]
    pytest: Vec<String>,
}

/// Returns the interpreter; an error tells why there is none.
pub(crate) fn interpreter() -> Result<PathBuf, String> {
    let name = std::env::var_os("ACTQ_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let [major, minor] = OLDEST;
    let wanted = format!("Python {major}.{minor} or later with venv is needed; ACTQ_PYTHON can name it");
    let script = "import ensurepip, sys, venv; print(*sys.version_info[:2])";
    let output = Command::new(&name).args(["-c", script]).stderr(Stdio::null()).output();
    let text = output.map_err(|error| format!("{}: {error}; {wanted}", name.display()))?.stdout;
    let version: Vec<u32> = String::from_utf8_lossy(&text).split_whitespace().flat_map(str::parse).collect();
    match version[..] {
        [] => Err(format!("{} has no module venv or ensurepip; {wanted}", name.display())),
        _ if version[..] >= OLDEST[..] => Ok(name),
        _ => Err(format!("{} is {version:?}; {wanted}", name.display())),
    }
}

/// Installs and tests the package.
pub(crate) fn test(Options { optional, pytest }: Options) -> Result<()> {
    let package = root().join(PACKAGE);
    let python = environment(&package, optional)?;
    // With the measuring library, both share what the tests have built.
    let command = ["build", "--profile", PROFILE, "--package", "actq-cli", "--package", "actq-bench", "--bin", "actq"];
    run(cargo().current_dir(root()).args(command))?;
    let wheels = target_dir().join("python/wheels");
    if wheels.exists() {
        fs::remove_dir_all(&wheels).context("cannot remove the old wheels")?;
    }
    let build = ["-m", "maturin", "build", "--profile", PROFILE, "--features", "checks", "--locked", "--out"];
    run(Command::new(&python).current_dir(&package).args(build).arg(&wheels))?;
    let install = ["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps", "--no-index", "--find-links"];
    run(Command::new(&python).args(install).arg(&wheels).arg("actq"))?;
    let actq = target_dir().join(PROFILE).join(format!("actq{}", std::env::consts::EXE_SUFFIX));
    let mut tests = Command::new(&python);
    tests.current_dir(&package).env("ACTQ", actq).args(["-m", "pytest", "-q"]).args(pytest);
    run(tests.envs(controller()?.map(|command| ("ACTQ_CONTROLLER", command))))?;
    run(Command::new(&python).current_dir(&package).args(["-m", "mypy"]))
}

/// Builds the motor controller, and returns the words of a command that runs it in QEMU, one a line, with its serial
/// port at the socket `{socket}`. Returns `None` if QEMU is not installed.
fn controller() -> Result<Option<String>> {
    let Some(board) = Target::on(BOARD).filter(|target| version(target.board().emulator).is_ok()) else {
        return Ok(None);
    };
    let elf = target_dir().join("python/controller.elf");
    let (limits, out) = (Some(LIMITS.to_owned()), Some(elf.clone()));
    firmware::Options { board: Some(board), limits, out, ..firmware::Options::default() }.run()?;
    let command = board.run_with_serial(&elf, "unix:{socket},server=on,wait=off", Clock::Host);
    let words = [command.get_program()].into_iter().chain(command.get_args());
    Ok(Some(words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join("\n")))
}

/// Makes the virtual environment, unless it has these requirements already; returns its interpreter.
fn environment(package: &Path, optional: bool) -> Result<PathBuf> {
    let base = interpreter().map_err(anyhow::Error::msg)?;
    let folder = target_dir().join("python/venv");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    let files = &REQUIREMENTS[..1 + usize::from(optional)];
    let texts = files.iter().map(|name| fs::read_to_string(package.join(name)).with_context(|| (*name).to_owned()));
    let wanted = format!("{}\n{}", base.display(), texts.collect::<Result<String>>()?);
    let stamp = folder.join("requirements");
    let present = fs::read_to_string(&stamp).unwrap_or_default();
    // An environment with more requirements has these, too.
    if present.starts_with(&wanted) {
        return Ok(python);
    }
    run(Command::new(base).args(["-m", "venv", "--clear"]).arg(&folder))?;
    let mut install = Command::new(&python);
    install.current_dir(package).args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    run(install.args(files.iter().flat_map(|name| ["-r", name])))?;
    fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
    Ok(python)
}

/// Runs a command to its end; it must succeed.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let words = [command.get_program()].into_iter().chain(command.get_args());
    let text = words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    println!("$ {text}");
    let status = command.stdin(Stdio::null()).status().with_context(|| format!("cannot start {text}"))?;
    ensure!(status.success(), "failed: {text}");
    Ok(())
}
