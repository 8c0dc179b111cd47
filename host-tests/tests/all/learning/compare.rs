//! A small comparison of methods.

use std::fs;
use std::path::Path;
use std::process::Output;

use actq_bench::command::{failed, research, run, succeeded};
use actq_research::compare::{Cell, Contender, Limit, Results};
use anyhow::{Context as _, Result, ensure};

/// Runs `cargo xtask compare` with two methods on a policy.
fn compare(folder: &Path, policy: &str, more: &[&str]) -> Result<Output> {
    let out = folder.display().to_string();
    let own = ["compare", "--policies", policy, "--out", &out];
    let options = "--methods rtn,distill --budgets 3.0,1.5 --episodes 2 --seed0 1000 --seed 1 --steps 20";
    run(research(&[&own, &options.split(' ').collect::<Vec<_>>()[..], more].concat()), b"")
}

#[test]
fn a_comparison_runs_once_and_explains_impossible_cells() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let folder = folder.path().join("results");
    succeeded(&compare(&folder, "ur3", &[])?)?;

    let Results { cells, header } = Results::read(&folder)?;
    ensure!(header.options["episodes"] == 2 && header.commits.len() == 1, "{header:?}");
    let found: Vec<_> = cells.iter().map(|cell| (cell.key.method, cell.key.budget)).collect();
    let methods = [Contender::Rtn, Contender::Distill].map(Some);
    let [few, many] = [1.5, 3.0].map(|bits| Some(Limit::Bits(bits)));
    let expected = [(methods[0], many), (methods[0], few), (methods[1], many), (methods[1], few)];
    ensure!(found[0] == (None, None) && found[1..] == expected, "{found:?}");
    let success = |cell: &Cell| cell.driven.as_ref().and_then(|driven| driven["success"].as_f64());
    ensure!(success(&cells[0]) == Some(1.0), "{:?}", cells[0]);
    let why = cells[2].why.as_deref().context("rtn must be impossible at 1.5 bits")?;
    ensure!(why.contains("2.078 bits per weight, with one scale a row"), "{why}");
    ensure!(cells[2].made.is_none() && cells[2].driven.is_none(), "{:?}", cells[2]);
    for cell in [&cells[1], &cells[3], &cells[4]] {
        let made = cell.made.as_ref().context("an image")?;
        let is_within = matches!(cell.key.budget, Some(Limit::Bits(bits)) if made.bpw <= bits);
        ensure!(made.nmse > 0.0 && is_within && success(cell).is_some(), "{cell:?}");
        ensure!(made.default_group && made.bytes_per_parameter < 1.0, "{made:?}");
        ensure!(made.milliseconds.is_some_and(|ms| (0.5..5.0).contains(&ms)), "{made:?}");
        ensure!(cell.seconds.is_some_and(|seconds| seconds > 0.0), "{cell:?}");
    }

    let report = fs::read_to_string(folder.join("compare.md"))?;
    for words in [
        "| method | bytes | ms | ms, CMSIS-NN | NMSE | success | tracking error, mm | bits (limit) |",
        "| f32 | 1328832 | - | - | 0 | 100 (34-100) | ",
        " (1.5) | ",
        " (3) | ",
        "predicted time of a step, at 168 MHz on a Cortex-M4",
        "- rtn at 1.5 bits is not made: the least is ",
        "--methods rtn,distill --budgets 3.0,1.5 --episodes 2 --seed0 1000 --seed 1 --steps 20",
    ] {
        ensure!(report.contains(words), "{words:?} is not in\n{report}");
    }
    // f32's interval begins at 34 %, so one of two episodes is enough. The rows of this table end after two figures.
    ensure!(report.contains("an image above with at least 34% success"), "{report}");
    for (method, cells) in [("rtn", &cells[1..3]), ("distill", &cells[3..5])] {
        let keeping = cells.iter().filter(|cell| success(cell).is_some_and(|success| success >= 0.5));
        let made: Vec<_> = keeping.filter_map(|cell| cell.made.as_ref()).collect();
        let bytes = made.iter().map(|made| made.bytes).min().context("an image keeps f32's success")?;
        let milliseconds = made.iter().filter_map(|made| made.milliseconds).min_by(f64::total_cmp);
        let row = format!("\n| {method} | {bytes} | {:.3} |\n", milliseconds.context("a time")?);
        ensure!(report.contains(&row), "{row:?} is not in\n{report}");
    }

    // Nothing is left to do, and a missing result is the only one that runs again.
    let log = || fs::read_to_string(folder.join("log.jsonl"));
    let before = log()?;
    succeeded(&compare(&folder, "ur3", &[])?)?;
    ensure!(log()? == before, "a finished cell ran again");
    let last = before.lines().last().and_then(|line| line.split('"').nth(3)).context("an address")?;
    let path = folder.join("store").join(format!("{last}.json"));
    let result = fs::read(&path)?;
    fs::remove_file(&path)?;
    succeeded(&compare(&folder, "ur3", &["--report"])?)?;
    ensure!(!path.exists(), "a report ran a job");
    succeeded(&compare(&folder, "ur3", &[])?)?;
    ensure!(fs::read(&path)? == result && log()?.lines().count() == before.lines().count() + 1);
    ensure!(
        fs::read_to_string(folder.join("compare.md"))?.lines().count() == report.lines().count(),
        "the report differs"
    );
    Ok(())
}

#[test]
fn a_missing_policy_is_named() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let output = compare(&folder.path().join("results"), "no_such_policy", &[])?;
    // With the shared policies the command looks for the folder; without them no policy remains.
    failed(&output, 1, &["no_such_policy: holds no policy.json"])
        .or_else(|_| failed(&output, 1, &["no policy is left"]))
}
