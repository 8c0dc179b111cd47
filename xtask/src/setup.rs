//! What must be installed: the Rust targets and QEMU.

use std::path::Path;
use std::process::{Command, Stdio};

use actq_host_tests::qemu::{self, QEMU, Target};
use anyhow::{Context, Result, bail, ensure};

/// A target that the kernels are built for but that nothing here runs: the usual packages of QEMU for Arm have no RISC-V.
pub(crate) const RISCV: &str = "riscv32imac-unknown-none-elf";

/// Installs what is missing, where that can be done without asking.
pub(crate) fn ensure() -> Result<()> {
    for triple in Target::ALL.map(Target::triple).into_iter().chain([RISCV]) {
        rust_target(triple)?;
    }
    if qemu::version().is_err() {
        install_qemu()?;
    }
    println!("{}", qemu::version()?);
    Ok(())
}

/// The text that a program prints.
pub(crate) fn output(program: &str, arguments: &[&str]) -> Result<String> {
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

fn rust_target(triple: &str) -> Result<()> {
    let root = output("rustc", &["--print", "sysroot"])?;
    if Path::new(root.trim()).join("lib/rustlib").join(triple).join("lib").is_dir() {
        return Ok(());
    }
    run("rustup", &["target", "add", triple])
        .with_context(|| format!("the Rust target {triple} is missing; `rustup target add {triple}` adds it"))
}

fn install_qemu() -> Result<()> {
    let exists = |program: &str| Command::new(program).arg("--version").output().is_ok();
    let root = output("id", &["-u"]).is_ok_and(|id| id.trim() == "0");
    if exists("apt-get") {
        if root {
            run("apt-get", &["update", "--quiet"])?;
            return run("apt-get", &["install", "--yes", "--quiet", "--no-install-recommends", "qemu-system-arm"]);
        }
        bail!("{QEMU} is missing; type: sudo apt-get install qemu-system-arm");
    }
    if exists("brew") {
        return run("brew", &["install", "qemu"]);
    }
    for (manager, line) in [
        ("dnf", "sudo dnf install qemu-system-arm"),
        ("pacman", "sudo pacman -S qemu-system-arm"),
        ("zypper", "sudo zypper install qemu-arm"),
    ] {
        if exists(manager) {
            bail!("{QEMU} is missing; type: {line}");
        }
    }
    bail!("{QEMU} is missing; install QEMU 7.0 or later for Arm systems")
}
