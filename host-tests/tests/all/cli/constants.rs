//! `actq constants`: source code that compilers accept, for names that no language has.

use std::fs;
use std::path::Path;
use std::process::Command;

use actq_bench::command::{actq, failed, run, succeeded};
use anyhow::{Result, ensure};
use tempfile::TempDir;

use super::fixture::text;
use crate::deployed::{MADE, Made};

/// Gains of a description whose network is never opened.
const GAINS: &str = r#"
schema = 1
name = "gains"
rate_hz = 50
action = "a"
joints = { motors = ["left/hip", "*/ int x; /*", "left hip"] }
gains = { joints = "motors", stiffness = [1, 2.5, 1e9], damping = [0, 0.125, 0] }
"#;

/// Options that accept no warning, and only check.
pub(super) const STRICT: [&str; 6] = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-fsyntax-only"];

pub(super) fn compiles(command: &mut Command) -> Result<()> {
    let output = command.output()?;
    let is_silent = output.status.success() && output.stderr.is_empty();
    ensure!(is_silent, "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

#[test]
fn compiled_constants_index_inputs_targets_and_joints() -> Result<()> {
    let dir = TempDir::new()?;
    let path = |name: &str| dir.path().join(name);
    let written = |name: &str| text(&path(name));
    fs::write(path("made.actq"), Made::deployment()?.1.four_bits()?)?;
    fs::write(path("deploy.toml"), GAINS)?;
    for name in ["walker 2.h", "made.rs"] {
        let (image, out, gains) = (written("made.actq"), written(name), written("deploy.toml"));
        succeeded(&run(actq(&["constants", &image, "--out", &out, "--gains", &gains]), b"")?)?;
    }
    let rust = fs::read_to_string(path("made.rs"))?;
    for part in [
        "//! Constants of the image \"every operation\"",
        "pub const RATE_HZ: f32 = 50.0;",
        "pub const OBSERVATION_LEN: usize = 12;",
        "/// Raw input \"quaternion\": its place in the observation.\npub const INPUT_QUATERNION: usize = 3;",
        "/// Place of \"b\" in the observation.\npub const INPUT_Q_B: usize = 1;",
        "/// Target velocities \"mixed\": its place in the action.\npub const TARGET_MIXED: usize = 3;",
        "pub const TARGET_MIXED_C: usize = 3;",
        "pub const STIFFNESS: [f32; 3] = [1.0, 2.5, 1000000000.0];",
    ] {
        ensure!(rust.contains(part), "{part} is not in\n{rust}");
    }
    let c = fs::read_to_string(path("walker 2.h"))?;
    for part in [
        "#ifndef ACTQ_WALKER_2_H",
        "#define WALKER_2_RATE_HZ 50.0f",
        "#define WALKER_2_INPUT_Q_B 1u",
        "#define WALKER_2_DAMPING {0.0f, 0.125f, 0.0f}",
    ] {
        ensure!(c.contains(part), "{part} is not in\n{c}");
    }
    compiles(
        Command::new("rustc")
            .args(["--crate-type", "lib", "-D", "warnings", "--out-dir"])
            .arg(dir.path())
            .arg(path("made.rs")),
    )?;
    let use_all = "#include \"walker 2.h\"\nstatic const float gains[] = WALKER_2_STIFFNESS;\n\
                   float at(const float *x);\nfloat at(const float *x) { return x[WALKER_2_INPUT_Q_B] + gains[1]; }\n";
    for (file, standard) in [("use.c", "-std=c99"), ("use.cpp", "-std=c++17")] {
        fs::write(path(file), use_all)?;
        if !has_compiler(&path(file), standard)? {
            println!("not run: no compiler for {file}");
            continue;
        }
        compiles(Command::new("cc").arg(standard).args(STRICT).arg(path(file)))?;
    }
    Ok(())
}

/// Returns `true` if the machine's compiler compiles an empty file of this language.
pub(super) fn has_compiler(file: &Path, standard: &str) -> Result<bool> {
    let empty = file.with_file_name(format!("empty.{}", file.extension().unwrap_or_default().display()));
    fs::write(&empty, "")?;
    let output = Command::new("cc").arg(standard).arg("-fsyntax-only").arg(empty).output();
    Ok(output.is_ok_and(|output| output.status.success()))
}

/// Names that become one identifier are an error that names both; those of a language's words are none.
#[test]
fn names_of_two_constants_are_refused() -> Result<()> {
    let dir = TempDir::new()?;
    let path = |name: &str| text(&dir.path().join(name));
    let cases = [
        ("angles", "q_len", "INPUT_Q_LEN", "the length of input \"q\" and of input \"q_len\""),
        ("angles", "Q", "INPUT_Q", "input \"q\" and of input \"Q\""),
        ("angles", "q-a", "INPUT_Q_A", "value \"a\" of input \"q\" and of input \"q-a\""),
        ("a", "len", "INPUT_Q_LEN", "the length of input \"q\" and of value \"len\" of input \"q\""),
        ("a", "b.", "INPUT_Q_B_", ""),
        ("a", "int", "", ""),
        ("angles", "static", "", ""),
    ];
    for (old, new, constant, owners) in cases {
        let description = MADE.replace(&format!("\"{old}\""), &format!("\"{new}\""));
        ensure!(description != MADE, "the fixture has changed");
        fs::write(dir.path().join("made.actq"), Made::deployment_of(&description)?.1.four_bits()?)?;
        for arguments in [["constants", "made.h"], ["constants", "made.rs"], ["export-c", "sources"]] {
            let (image, out) = (path("made.actq"), path(arguments[1]));
            let output = run(actq(&[arguments[0], &image, "--out", &out, "--force"]), b"")?;
            if owners.is_empty() {
                succeeded(&output)?;
            } else {
                failed(&output, 1, &[constant, owners, "rename one of them"])?;
            }
        }
    }
    Ok(())
}
