//! A small comparison of methods.

use std::fs;
use std::path::Path;

use actq_research::compare::{Cell, Contender, Journal, Plan, run};
use anyhow::{Context as _, Result, ensure};

fn plan(folder: &Path) -> Plan {
    Plan {
        policies: vec!["ur3".to_owned()],
        methods: vec![Contender::Rtn, Contender::Distill],
        budgets: vec![3.0, 1.5],
        episodes: 2,
        seed0: 1000,
        seed: 1,
        steps: Some(20),
        out: folder.to_owned(),
        report: false,
    }
}

#[test]
fn a_comparison_runs_once_and_explains_impossible_cells() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let folder = folder.path().join("results");
    let plan = plan(&folder);
    run(&plan)?;

    let Journal { cells, header, .. } = Journal::read(&folder)?;
    ensure!(header.options["episodes"] == 2, "{header:?}");
    let found: Vec<_> = cells.iter().map(|cell| (cell.key.method, cell.key.budget)).collect();
    let methods = [Contender::Rtn, Contender::Distill].map(Some);
    let [few, many] = [1.5, 3.0].map(Some);
    let expected = [(methods[0], many), (methods[0], few), (methods[1], many), (methods[1], few)];
    ensure!(found[0] == (None, None) && found[1..] == expected, "{found:?}");
    let success = |cell: &Cell| cell.driven.as_ref().and_then(|driven| driven["success"].as_f64());
    ensure!(success(&cells[0]) == Some(1.0), "{:?}", cells[0]);
    let why = cells[2].why.as_deref().context("rtn must be impossible at 1.5 bits")?;
    ensure!(why.contains("2.078 bits per weight, with one scale a row"), "{why}");
    ensure!(cells[2].made.is_none() && cells[2].driven.is_none(), "{:?}", cells[2]);
    for cell in [&cells[1], &cells[3], &cells[4]] {
        let made = cell.made.as_ref().context("an image")?;
        ensure!(made.nmse > 0.0 && Some(made.bpw) <= cell.key.budget && success(cell).is_some(), "{cell:?}");
        ensure!(made.default_group && made.bytes_per_parameter < 1.0, "{made:?}");
        ensure!(made.milliseconds.is_some_and(|ms| (0.5..5.0).contains(&ms)), "{made:?}");
    }

    let report = fs::read_to_string(folder.join("compare.md"))?;
    for words in [
        "| method | bytes | ms | NMSE | success | tracking error, mm | bits (limit) |",
        "| f32 | 1328832 | - | 0 | 100 (34-100) | ",
        " (1.5) | ",
        " (3) | ",
        "predicted time of a step, at 168 MHz on a Cortex-M4",
        "- rtn at 1.5 bits is not made: the least is ",
        "--methods rtn,distill --budgets 3.0,1.5 --episodes 2 --seed0 1000 --seed 1 --steps 20",
    ] {
        ensure!(report.contains(words), "{words:?} is not in\n{report}");
    }

    let picture = fs::read_to_string(folder.join("compare.svg"))?;
    ensure!(picture.contains("ur3: success over flash and over time (f32: 100%)"), "{picture}");

    // The seconds in it would differ.
    let journal = fs::read_to_string(folder.join("compare.jsonl"))?;
    run(&plan)?;
    ensure!(fs::read_to_string(folder.join("compare.jsonl"))? == journal, "a finished cell ran again");
    // A run that stopped within a line resumes after the line before it.
    let cut = journal.trim_end().rfind('\n').context("lines")? + 20;
    fs::write(folder.join("compare.jsonl"), &journal[..cut])?;
    run(&plan)?;
    let again = fs::read_to_string(folder.join("compare.jsonl"))?;
    ensure!(again[..cut] == journal[..cut] && again.lines().count() == journal.lines().count(), "{again}");

    let error =
        run(&Plan { episodes: 3, ..plan.clone() }).err().context("expected a refusal of other options")?.to_string();
    ensure!(
        error.contains("compare.jsonl: holds results of other sources or options") && error.contains("--out"),
        "{error}"
    );
    fs::remove_file(folder.join("compare.md"))?;
    run(&Plan { report: true, ..plan })?;
    ensure!(
        fs::read_to_string(folder.join("compare.md"))?.lines().count() == report.lines().count(),
        "the report differs"
    );
    Ok(())
}

#[test]
fn a_missing_policy_is_named() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let plan = Plan { policies: vec!["no_such_policy".to_owned()], ..plan(folder.path()) };
    let error = run(&plan).err().context("expected a refusal of the missing policy")?.to_string();
    // With the shared policies the command looks for the folder; without them no policy remains.
    ensure!(error.contains("no_such_policy: holds no policy.json") || error.contains("no policy is left"), "{error}");
    Ok(())
}
