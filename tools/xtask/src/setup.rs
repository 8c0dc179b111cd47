//! The requirements: the Rust targets, QEMU, and for `cargo verify` the toolchain's tools and the oldest compiler.

use std::path::Path;
use std::process::{Command, Stdio};

use actq_boards::{Target, version};
use anyhow::{Context, Result, bail, ensure};

/// Returns the cargo that runs this program.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Installs the missing requirements of these targets, if possible without a question.
pub(crate) fn ensure(targets: &[Target]) -> Result<()> {
    for target in targets {
        rust_target(target.triple())?;
    }
    let mut emulators: Vec<_> = targets.iter().map(|target| target.board().emulator).collect();
    emulators.sort_unstable();
    emulators.dedup();
    for emulator in emulators {
        if version(emulator).is_err() {
            install(emulator)?;
        }
        println!("{emulator}: {}", version(emulator).with_context(|| format!("{emulator} is not installed"))?);
    }
    Ok(())
}

/// Installs the requirements of all commands, and names those that only some tests need.
pub(crate) fn doctor() -> Result<()> {
    ensure(&Target::ALL)?;
    rust_target(crate::wasm::TARGET)?;
    let optional = [
        node().map_err(|why| format!("tests of the npm package: {why}")),
        browser().map_err(|why| format!("tests of the pages: {why}")),
    ];
    let missing: Vec<String> = optional.into_iter().filter_map(Result::err).collect();
    missing.iter().for_each(|why| println!("missing: {why}"));
    if missing.is_empty() {
        println!("nothing is missing");
    }
    Ok(())
}

/// Checks for a Node that runs the npm package; an error names what to install.
pub(crate) fn node() -> Result<(), String> {
    let missing = || "Node 20 or later is missing; install nodejs".to_owned();
    let version = output("node", &["--version"]).map_err(|_| missing())?;
    let major = version.trim().trim_start_matches('v').split('.').next().and_then(|major| major.parse::<u32>().ok());
    if major.is_some_and(|major| major >= 20) { Ok(()) } else { Err(missing()) }
}

/// Checks for a Chromium, and for npm, which brings its client; an error names what to install.
pub(crate) fn browser() -> Result<(), String> {
    let found = output("chromium", &["--version"]).and_then(|_| output("npm", &["--version"]));
    found
        .map(drop)
        .map_err(|_| "Chromium or npm is missing; on Debian, install the packages chromium and npm".to_owned())
}

/// Installs cargo's tools that a toolchain may lack.
pub(crate) fn components() -> Result<()> {
    for (component, subcommand) in [("rustfmt", "fmt"), ("clippy", "clippy")] {
        if output("cargo", &[subcommand, "--version"]).is_err() {
            run("rustup", &["component", "add", component])
                .with_context(|| format!("{component} is missing; `rustup component add {component}` adds it"))?;
        }
    }
    Ok(())
}

/// Installs a toolchain beside the one in use; an error tells why that is impossible.
pub(crate) fn toolchain(release: &str) -> Result<(), String> {
    let installed = output("rustup", &["toolchain", "list"]).map_err(|error| format!("{error:#}"))?;
    if installed.lines().any(|line| line.starts_with(release)) {
        return Ok(());
    }
    let arguments = ["toolchain", "install", release, "--profile", "minimal", "--no-self-update"];
    run("rustup", &arguments).map_err(|_| format!("rustup cannot install {release}"))
}

fn output(program: &str, arguments: &[&str]) -> Result<String> {
    let output =
        Command::new(program).args(arguments).output().with_context(|| format!("{program} is not installed"))?;
    ensure!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn run(program: &str, arguments: &[&str]) -> Result<()> {
    println!("$ {program} {}", arguments.join(" "));
    let status = Command::new(program).args(arguments).stdin(Stdio::null()).status();
    ensure!(status.with_context(|| format!("{program} is not installed"))?.success(), "{program} failed");
    Ok(())
}

/// Installs a Rust target.
pub(crate) fn rust_target(triple: &str) -> Result<()> {
    let root = output("rustc", &["--print", "sysroot"])?;
    if Path::new(root.trim()).join("lib/rustlib").join(triple).join("lib").is_dir() {
        return Ok(());
    }
    run("rustup", &["target", "add", triple])
        .with_context(|| format!("the Rust target {triple} is missing; `rustup target add {triple}` adds it"))
}

fn install(emulator: &str) -> Result<()> {
    let exists = |program: &str| Command::new(program).arg("--version").output().is_ok();
    let root = output("id", &["-u"]).is_ok_and(|id| id.trim() == "0");
    let riscv = emulator == Target::Riscv.board().emulator;
    if exists("apt-get") {
        // A package has the emulator's name, or provides it: RISC-V's is qemu-system-misc in Debian 12.
        if root {
            run("apt-get", &["update", "--quiet"])?;
            return run("apt-get", &["install", "--yes", "--quiet", "--no-install-recommends", emulator]);
        }
        bail!("{emulator} is missing; type: sudo apt-get install {emulator}");
    }
    if exists("brew") {
        return run("brew", &["install", "qemu"]);
    }
    for (manager, line, arm_package, riscv_package) in [
        ("dnf", "sudo dnf install", "qemu-system-arm", "qemu-system-riscv"),
        ("pacman", "sudo pacman -S", "qemu-system-arm", "qemu-system-riscv"),
        ("zypper", "sudo zypper install", "qemu-arm", "qemu-extra"),
    ] {
        if exists(manager) {
            bail!("{emulator} is missing; type: {line} {}", if riscv { riscv_package } else { arm_package });
        }
    }
    bail!("{emulator} is missing; install QEMU 7.0 or later for {} systems", if riscv { "RISC-V" } else { "Arm" })
}
