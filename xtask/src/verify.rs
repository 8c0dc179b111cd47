//! What CI checks. Every step runs, and all failures are reported at the end.

use std::process::Command;
use std::time::Instant;

use actq_host_tests::qemu::Target;
use anyhow::{Context, Result, bail};

use crate::bench::placeholder;

/// A step: its name, the arguments of cargo, and environment variables.
type Step<'a> = (&'a str, Vec<&'a str>, Vec<(&'a str, String)>);

/// Runs all steps.
pub(crate) fn run() -> Result<()> {
    // The firmware includes an image by path. Lints and documentation do not run it, so any file will do for them.
    let placeholder = placeholder()?;
    let image = || ("ACTQ_IMAGE", placeholder.display().to_string());
    let deny = || ("RUSTDOCFLAGS", "-D warnings".to_owned());
    let firmware = |command, target: Target| {
        vec![command, "--package", "actq-firmware-demo", "--package", "actq-kernels", "--target", target.triple()]
    };
    let lints = ["--", "-D", "warnings"];
    let mut steps: Vec<Step<'_>> = vec![
        ("format", vec!["fmt", "--all", "--check"], vec![]),
        (
            "lints",
            [&["clippy", "--workspace", "--all-targets", "--exclude", "actq-firmware-demo"], &lints[..]].concat(),
            vec![],
        ),
    ];
    // RISC-V has the binaries that run on it; the others measure the Cortex-M4.
    let portable = ["--lib", "--bin", "actq-firmware-demo", "--bin", "golden", "--bin", "portable"];
    for (target, binaries) in [(Target::Fpu, &[][..]), (Target::NoFpu, &[]), (Target::Riscv, &portable)] {
        let arguments = [&firmware("clippy", target), binaries, &lints].concat();
        steps.push(("lints of the firmware", arguments, vec![image()]));
    }
    let others = [Target::NoDsp, Target::Small, Target::Riscv].map(|target| ["--target", target.triple()]).concat();
    for (name, command, arguments) in
        [("lints of the portable kernels", "clippy", &lints[..]), ("portable kernels", "build", &["--release"])]
    {
        steps.push((name, [&[command, "--package", "actq-kernels"], &others[..], arguments].concat(), vec![]));
    }
    steps.extend([
        (
            "documentation",
            vec!["doc", "--no-deps", "--workspace", "--exclude", "actq-firmware-demo", "--exclude", "xtask"],
            vec![deny()],
        ),
        (
            "documentation of the firmware",
            [firmware("doc", Target::Fpu), vec!["--no-deps"]].concat(),
            vec![deny(), image()],
        ),
        ("tests", vec!["test", "--release"], vec![]),
        ("budgets", vec!["run", "--release", "--package", "xtask", "--", "budgets"], vec![]),
    ]);
    let mut failed = Vec::new();
    for (name, arguments, environment) in steps {
        println!("\n== {name}: cargo {}", arguments.join(" "));
        let start = Instant::now();
        let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .current_dir(actq_host_tests::root())
            .args(&arguments)
            .envs(environment)
            .status()
            .context("cargo cannot be started")?;
        println!(
            "== {name}: {} in {:.0} s",
            if status.success() { "ok" } else { "FAILED" },
            start.elapsed().as_secs_f32()
        );
        if !status.success() {
            failed.push(name);
        }
    }
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    println!("\nall checks passed");
    Ok(())
}
