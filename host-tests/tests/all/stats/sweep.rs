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
    let line =
        "sweep policy other --bpw 2.5,3.5,5 --methods actquant,distill --steps 3 --threads 2 --json s.json --svg s.svg";
    let printed = succeeded(&fixture.actq(line)?)?;
    let value: Value = serde_json::from_slice(&fs::read(fixture.path("s.json"))?)?;
    assert_eq!(value.as_array().map(Vec::len), Some(2));
    let stars = |v: &Value| usize::from(!v["knee"].is_null());
    let rows = [HIDDEN, HIDDEN, ACT];
    for sweep in value.as_array().context("no array")? {
        assert_eq!(sweep["clock_hz"], 168e6);
        for curve in sweep["curves"].as_array().context("curves")? {
            assert_eq!(curve["scores"].as_array().map(Vec::len), (curve["method"] == "actquant").then_some(3));
            for point in curve["points"].as_array().context("points")?.iter().filter(|p| !p.is_null()) {
                let counts: Vec<BTreeMap<u32, usize>> = serde_json::from_value(point["rows"].clone())?;
                assert_eq!(counts.iter().map(|c| c.values().sum::<usize>()).collect::<Vec<_>>(), rows);
                let cells =
                    [point["bytes"].to_string(), format!("{:.3}", point["milliseconds"].as_f64().context("ms")?)];
                let row = |line: &&str| cells.iter().all(|cell| line.split_whitespace().any(|word| word == cell));
                ensure!(printed.lines().filter(row).count() > 0, "{cells:?} are not in a row of\n{printed}");
            }
        }
    }
    assert_eq!(value[0], value[1], "the same policy in two folders");
    let marked = printed.lines().filter(|l| !l.starts_with('*')).map(|l| l.matches('*').count()).sum::<usize>();
    assert_eq!(marked, stars(&value[0]) + stars(&value[1]), "{printed}");
    assert_eq!(fs::read_to_string(fixture.path("s.svg"))?.matches("<polyline").count(), 8);
    let seed = |n: u32| -> Result<Value> {
        succeeded(
            &fixture.actq(&format!("sweep policy --bpw 4 --methods distill --steps 3 --seed {n} --json t.json"))?,
        )?;
        Ok(serde_json::from_slice(&fs::read(fixture.path("t.json"))?)?)
    };
    let (one, again, two) = (seed(1)?, seed(1)?, seed(2)?);
    ensure!(one == again && one != two, "the seed has no effect on the images");
    Ok(())
}
