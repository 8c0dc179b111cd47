//! `cargo xtask python`: builds and tests the Python package in a virtual environment below the target directory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use actq_boards::{Clock, Target, root, target_dir, version};
use anyhow::{Context as _, Result, ensure};

use crate::setup::cargo;
use crate::{PROFILE, firmware};

const USAGE: &str = "\
Usage: cargo xtask python [--optional] [-- PYTEST...]

Makes a virtual environment below the target directory, builds and installs the Python package, runs its tests, and checks
its types. Needs Python 3.9 or later with venv: python3, or the interpreter that ACTQ_PYTHON names.

  --optional  Also install torch, Stable-Baselines3 and Ray, and run the tests that need them
  PYTEST...   Arguments for pytest, as -k head";

/// The oldest supported version of Python.
const OLDEST: [u32; 2] = [3, 9];
/// The package, from the workspace's root.
const PACKAGE: &str = "quantizer/python";
/// Requirements of the tests, and of those that only `--optional` runs.
const REQUIREMENTS: [&str; 2] = ["requirements-test.txt", "requirements-optional.txt"];

/// Board of the motor controller that the link's tests run in QEMU, and the range of its axes.
const BOARD: &str = "mps2-an386";
const LIMITS: &str = "-3:3";

/// The request.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Options {
    Help,
    Test { optional: bool, pytest: Vec<String> },
}

impl Options {
    /// Parses the words after `python`; an error is the text for the user.
    pub(crate) fn parse(words: &[&str]) -> Result<Self, String> {
        let (own, pytest) = match words.iter().position(|word| *word == "--") {
            Some(at) => (&words[..at], &words[at + 1..]),
            None => (words, &[][..]),
        };
        let pytest = pytest.iter().map(|word| (*word).to_owned()).collect();
        match own {
            [] => Ok(Self::Test { optional: false, pytest }),
            ["--optional"] => Ok(Self::Test { optional: true, pytest }),
            ["--help" | "-h"] => Ok(Self::Help),
            _ => Err(format!("error: unknown options {}\n\n{USAGE}", own.join(" "))),
        }
    }

    pub(crate) fn run(self) -> Result<()> {
        match self {
            Self::Help => {
                println!("{USAGE}");
                Ok(())
            }
            Self::Test { optional, pytest } => test(optional, &pytest),
        }
    }
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

fn test(optional: bool, pytest: &[String]) -> Result<()> {
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
    let out = elf.display().to_string();
    let words = ["--board", BOARD, "--limits", LIMITS, "--out", &out];
    firmware::Options::parse(&words).map_err(anyhow::Error::msg)?.run()?;
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

fn run(command: &mut Command) -> Result<()> {
    let words = [command.get_program()].into_iter().chain(command.get_args());
    let text = words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ");
    println!("$ {text}");
    let status = command.stdin(Stdio::null()).status().with_context(|| format!("cannot start {text}"))?;
    ensure!(status.success(), "failed: {text}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_or_refused() {
        assert_eq!(Options::parse(&[]), Ok(Options::Test { optional: false, pytest: Vec::new() }));
        let pytest = vec!["-k".to_owned(), "head".to_owned()];
        assert_eq!(Options::parse(&["--optional", "--", "-k", "head"]), Ok(Options::Test { optional: true, pytest }));
        assert_eq!(Options::parse(&["-h"]), Ok(Options::Help));
        assert!(
            Options::parse(&["-k"]).is_err_and(|text| text.contains("unknown options -k") && text.contains("Usage"))
        );
    }
}
