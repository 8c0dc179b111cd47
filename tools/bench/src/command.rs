//! The commands `actq` and `actq-research` for tests and measurements.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};

use crate::firmware::cargo_build;

/// Returns the path of the command `actq`, built once.
pub fn binary() -> Result<&'static Path> {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    built(&BINARY, "actq")
}

/// Builds the command `name`, unless `path` holds its path already, in the profile of this build and
/// beside it: cargo does not build the binaries of a dependency.
fn built(path: &'static OnceLock<PathBuf>, name: &str) -> Result<&'static Path> {
    if let Some(path) = path.get() {
        return Ok(path);
    }
    let program = std::env::current_exe().context("cannot find the running executable")?;
    let folder = program.parent().context("the running executable has no folder")?;
    // A test is in the subfolder `deps` of its profile's folder.
    let folder = if folder.ends_with("deps") { folder.parent().unwrap_or(folder) } else { folder };
    let profile = folder.file_name().and_then(|name| name.to_str()).context("the profile's name is not UTF-8")?;
    let profile = if profile == "debug" { "dev" } else { profile };
    // Of all packages, as the tests: for some of them cargo would choose other features, and build the libraries again.
    cargo_build(name, &["--bin", name, "--profile", profile], &[])?;
    Ok(path.get_or_init(|| folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))))
}

/// Returns the command `actq` with arguments.
pub fn actq(arguments: &[&str]) -> Command {
    let mut command = Command::new(binary().expect("actq builds"));
    command.args(arguments);
    command
}

/// Returns the command `actq-research` with arguments.
pub fn research(arguments: &[&str]) -> Command {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    let mut command = Command::new(built(&BINARY, "actq-research").expect("actq-research builds"));
    command.args(arguments);
    command
}

/// Runs a command with the standard input `input`.
pub fn run(mut command: Command, input: &[u8]) -> Result<Output> {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    // A command that stops early closes the pipe; its exit status tells why.
    drop(stdin.write_all(input));
    drop(stdin);
    Ok(child.wait_with_output()?)
}

/// Returns the standard output of a run that must succeed.
pub fn succeeded(output: &Output) -> Result<String> {
    Ok(String::from_utf8(answered(output)?.to_vec())?)
}

/// Does the same as [`succeeded`] for binary output.
pub fn answered(output: &Output) -> Result<&[u8]> {
    ensure!(output.status.code() == Some(0), "{}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    Ok(&output.stdout)
}

/// Requires an exit status and a message with all of `words`, and no panic.
pub fn failed(output: &Output, status: i32, words: &[&str]) -> Result<()> {
    let message = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.code() == Some(status), "expected {status}, got {}: {message}", output.status);
    ensure!(!message.trim().is_empty() && !message.contains("panicked"), "expected an error message, got {message:?}");
    let missing: Vec<_> = words.iter().filter(|word| !message.contains(**word)).collect();
    ensure!(missing.is_empty(), "the message lacks {missing:?}: {message}");
    Ok(())
}

/// Fails with all errors of `results`, so that one wrong message does not hide the others.
pub fn all(results: impl IntoIterator<Item = (String, Result<()>)>) -> Result<()> {
    let wrong: Vec<String> =
        results.into_iter().filter_map(|(what, result)| Some(format!("{what}: {:#}", result.err()?))).collect();
    ensure!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    Ok(())
}
