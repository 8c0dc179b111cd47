//! `actq inspect`: its report on an image, and the predicted time.

use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, run, succeeded};
use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::fixture::{Fixture, text};

#[test]
fn inspect_shows_name_source_scratch_and_contract() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("")?;
    let report = succeeded(&run(actq(&["inspect", &text(&path)]), b"")?)?;
    let digest: String = Policy::load(&fixture.policy())?.digest.iter().map(|b| format!("{b:02x}")).collect();
    let scratch = 4 * ImageBuffer::read(&path)?.image(&path)?.scratch_words();
    for part in ["tiny arm", &digest, &format!("{scratch} bytes"), "chunk of 4, 2 executed", "25 Hz"] {
        ensure!(report.contains(part), "{part:?} is not in\n{report}");
    }
    // No column is empty: the policy has no rates.
    let heads = ["action", "scale", "offset", "low", "high"];
    let row = ["1", "1", "0", "-1.5", "1.5"];
    for line in [heads, row] {
        ensure!(report.lines().any(|found| found.split_whitespace().eq(line)), "no line {line:?} in\n{report}");
    }
    Ok(())
}

#[test]
fn inspect_predicts_the_time_of_every_operation() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = text(&fixture.image("")?);
    let inspect = |arguments: &[&str]| succeeded(&run(actq(&[&["inspect", &path], arguments].concat()), b"")?);
    let json = |clock: &str| -> Result<Value> { Ok(serde_json::from_str(&inspect(&["--json", "--clock", clock])?)?) };
    let step = json("100M")?;
    let ops = step["ops"].as_array().context("no operations")?;
    for key in ["instructions", "cycles", "macs"] {
        let number = |value: &Value| value[key].as_u64().with_context(|| format!("{key} is not a number"));
        let sum = ops.iter().map(number).sum::<Result<u64>>()?;
        // Operations are rounded one by one.
        ensure!(sum.abs_diff(number(&step)?) <= ops.len() as u64 && sum > 0, "{key}: {sum} against {step}");
    }
    let milliseconds = |step: &Value| step["milliseconds"].as_f64().context("no milliseconds");
    let cycles = step["cycles"].as_f64().context("no cycles")?;
    ensure!((milliseconds(&step)? - cycles / 100e3).abs() < 1e-9, "{step}");
    ensure!(
        (milliseconds(&json("50000K")?)? - 2.0 * milliseconds(&step)?).abs() < 1e-9,
        "half the clock must take twice the time"
    );
    let report = inspect(&[])?;
    let cycles = step["cycles"].to_string();
    ensure!(report.contains("at 168 MHz") && report.contains(&cycles), "{report}");
    Ok(())
}
