//! The files of a sweep.

use std::collections::BTreeMap;
use std::fs;

use actq_bench::command::succeeded;
use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::fixture::{ACT, Fixture, HIDDEN};

#[test]
fn a_sweep_stores_allocations_and_scores() -> Result<()> {
    let (fixture, other) = (Fixture::new()?, Fixture::new()?);
    fs::rename(other.policy(), fixture.path("other"))?;
    // The same network, but another policy: the description has one more space.
    let description = fixture.path("other/policy.json");
    fs::write(&description, format!("{} ", fs::read_to_string(&description)?))?;
    let line = "sweep policy other --bpw 2.5,3.5,5 --methods actquant,distill --steps 3 --threads 2 --json s.json";
    let printed = succeeded(&fixture.actq(line)?)?;
    let value: Value = serde_json::from_slice(&fs::read(fixture.path("s.json"))?)?;
    assert_eq!(value["clock_hz"], 168e6);
    let policies = value["policies"].as_array().context("policies")?;
    let rows = [HIDDEN, HIDDEN, ACT];
    for policy in policies {
        for image in policy["images"].as_array().context("images")?.iter().filter(|image| !image["made"].is_null()) {
            let made = &image["made"]["image"];
            assert_eq!(
                made["scores"].as_array().map(Vec::len),
                Some(if image["method"] == "actquant" { 3 } else { 0 })
            );
            let counts: Vec<BTreeMap<u32, usize>> = serde_json::from_value(made["rows"].clone())?;
            assert_eq!(counts.iter().map(|c| c.values().sum::<usize>()).collect::<Vec<_>>(), rows);
            let cycles = made["cycles"].as_f64().context("cycles")?;
            let cells = [made["bytes"].to_string(), format!("{:.3}", 1e3 * cycles / 168e6)];
            let row = |line: &&str| cells.iter().all(|cell| line.split_whitespace().any(|word| word == cell));
            ensure!(printed.lines().filter(row).count() > 0, "{cells:?} are not in a row of\n{printed}");
        }
    }
    let errors = |policy: &Value| -> Option<Vec<Value>> {
        Some(policy["images"].as_array()?.iter().map(|image| image["made"]["nmse"].clone()).collect())
    };
    ensure!(policies.len() == 2 && errors(&policies[0]) == errors(&policies[1]), "the same network in two folders");
    assert_eq!((&policies[0]["policy"], &policies[1]["policy"]), (&"small leg".into(), &"small leg (2)".into()));
    let stars = policies.iter().filter_map(|policy| Some(policy["frontier"].as_array()?.len())).sum::<usize>();
    let marked = printed.lines().filter(|l| !l.starts_with('*')).map(|l| l.matches('*').count()).sum::<usize>();
    assert_eq!(marked, stars, "{printed}");
    let seed = |n: u32| -> Result<Value> {
        succeeded(
            &fixture.actq(&format!("sweep policy --bpw 4 --methods distill --steps 200 --seed {n} --json t.json"))?,
        )?;
        let value: Value = serde_json::from_slice(&fs::read(fixture.path("t.json"))?)?;
        Ok(value["policies"][0]["images"][0]["made"]["image"]["image"].clone())
    };
    let (one, again, two) = (seed(1)?, seed(1)?, seed(2)?);
    ensure!(one.is_string() && one == again && one != two, "the seed has no effect on the images");
    Ok(())
}
