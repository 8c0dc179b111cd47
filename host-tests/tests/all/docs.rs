//! What the documents show in C, Python and TOML parses.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use actq_bench::command::{actq, run, succeeded};
use actq_bench::firmware::cargo;
use actq_bench::{root, skipped};
use actq_deploy::Answers;
use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use tempfile::TempDir;

fn read(path: &str) -> Result<String> {
    fs::read_to_string(root().join(path)).with_context(|| path.to_owned())
}

/// Cargo packages the files in a crate's folder only.
#[test]
fn shipped_packages_hold_their_licences() -> Result<()> {
    let manifest = read("Cargo.toml")?;
    let members: Vec<&str> =
        manifest.split('"').filter(|part| root().join(part).join("Cargo.toml").is_file()).collect();
    let mut shipped = vec!["python"];
    for member in members {
        if !read(&format!("{member}/Cargo.toml"))?.contains("publish = false") {
            shipped.push(member);
        }
    }
    ensure!(shipped.len() >= 12, "{shipped:?}");
    for (folder, name) in shipped.iter().flat_map(|folder| [(folder, "LICENSE-MIT"), (folder, "LICENSE-APACHE")]) {
        ensure!(read(&format!("{folder}/{name}"))? == read(name)?, "{folder}/{name} is not the project's");
    }
    Ok(())
}

/// Every direct dependency of the workspace and of the fuzz targets has its reason in RELEASING, and no other crate.
#[test]
fn each_dependency_has_its_reason() -> Result<()> {
    let text = read("RELEASING.md")?;
    let (_, table) = text.split_once("## Dependencies\n").context("RELEASING.md has no section Dependencies")?;
    let crates = table.lines().filter_map(|row| row.strip_prefix("| `")?.split('|').next());
    let listed: BTreeSet<&str> =
        crates.flat_map(|cell| cell.split(['`', ',', ' '])).filter(|name| !name.is_empty()).collect();
    let mut used = BTreeSet::new();
    for manifest in ["Cargo.toml", "fuzz/Cargo.toml"] {
        let metadata = ["metadata", "--no-deps", "--offline", "--format-version", "1", "--manifest-path", manifest];
        let metadata: Value = serde_json::from_str(&cargo("the list of dependencies", &metadata, &[])?)?;
        let packages = metadata["packages"].as_array().into_iter().flatten();
        let of_all = packages.flat_map(|package| package["dependencies"].as_array().into_iter().flatten());
        let others = of_all.filter(|dependency| dependency["path"].is_null());
        used.extend(others.filter_map(|dependency| Some(dependency["name"].as_str()?.to_owned())));
    }
    let used: BTreeSet<&str> = used.iter().map(String::as_str).collect();
    let differing: Vec<_> = used.symmetric_difference(&listed).collect();
    ensure!(differing.is_empty(), "RELEASING.md lacks, or lists without need, {differing:?}");
    Ok(())
}

pub(crate) fn listings<'a>(document: &'a str, language: &str) -> Vec<&'a str> {
    let parts = document.split(&format!("```{language}\n")).skip(1).collect::<Vec<_>>();
    parts.into_iter().filter_map(|rest| rest.split("```").next()).collect()
}

#[test]
fn shown_answers_are_read() -> Result<()> {
    let text = read("docs/DEPLOY.md")?;
    let answers = listings(&text, "toml");
    ensure!(answers.len() == 1, "docs/DEPLOY.md has {} listings of answers", answers.len());
    let family = read("docs/families/holosoma.md")?;
    for answers in answers.into_iter().chain(listings(&family, "toml")) {
        Answers::parse(answers)?;
    }
    Ok(())
}

/// The Python package's tests run the listings of PYTHON and IMPORT; this one needs lerobot.
#[test]
fn the_shown_export_of_lerobot_parses() -> Result<()> {
    let text = read("docs/families/lerobot.md")?;
    let [listing] = listings(&text, "python")[..] else { bail!("docs/families/lerobot.md has one listing in Python") };
    let mut python = Command::new("python3");
    python.args(["-c", "import ast, sys; ast.parse(sys.stdin.read())"]);
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("python3 is not installed");
        return Ok(());
    }
    succeeded(&run(python, listing.as_bytes())?)?;
    Ok(())
}

#[test]
fn shown_c_compiles() -> Result<()> {
    let text = read("docs/C.md")?;
    let &[listing] = &listings(&text, "c")[..] else { bail!("docs/C.md has one listing in C") };
    let dir = TempDir::new()?;
    let path = |name: &str| dir.path().join(name);
    fs::copy(root().join("kernels/tests/valid.actq"), path("policy.actq"))?;
    let [image, policy] = ["policy.actq", "policy"].map(|name| path(name).display().to_string());
    succeeded(&run(actq(&["export-c", &image, "--out", &policy]), b"")?)?;
    let program = format!(
        "#include \"actq.h\"\n#include \"policy.h\"\n\
         void act(const float *observation, float *action);\n\
         void act(const float *observation, float *action) {{\n{listing}\n}}\n"
    );
    fs::write(path("listing.c"), program)?;
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", "-fsyntax-only"]);
    compiler.arg("-I").arg(root().join("capi/include")).arg("-I").arg(&policy).arg(path("listing.c"));
    match compiler.output() {
        Err(_) => skipped("cc is not installed"),
        Ok(output) => ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
    }
    Ok(())
}
