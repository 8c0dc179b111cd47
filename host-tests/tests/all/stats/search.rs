//! The fewest bits for an error (`--max-nmse`).

use std::fs;

use actq_bench::command::{failed, succeeded};
use anyhow::{Context, Result, ensure};
use serde_json::json;

use super::fixture::Fixture;

#[test]
fn the_search_keeps_the_error_with_fewest_bits() -> Result<()> {
    let fixture = Fixture::new()?;
    for method in ["rtn", "gptq", "actquant"] {
        let value = fixture.image("fewest", &format!("--method {method} --max-nmse 0.02"))?;
        assert_eq!(value["budget"], json!({"max_nmse": 0.02}));
        let nmse = fixture.nmse("fewest.actq")?;
        ensure!(nmse <= 0.02, "{method}: {nmse}");
        // The same bytes as with the budget itself; a tenth of a bit less is too few.
        let printed = succeeded(&fixture.quantize(&format!("--out again.actq --method {method} --max-nmse 0.02"))?)?;
        let line = printed.lines().find(|l| l.contains("keep the error within 0.02")).context("no result")?;
        let budget: f64 = line.split_whitespace().next().context("no budget")?.parse()?;
        let less = budget - 0.1;
        ensure!(line.contains(&format!("{less:.1} is too few")), "{line}");
        fixture.image("same", &format!("--method {method} --bpw {budget:.1}"))?;
        let image = fs::read(fixture.path("fewest.actq"))?;
        ensure!(image == fs::read(fixture.path("again.actq"))? && image == fs::read(fixture.path("same.actq"))?);
        fixture.image("less", &format!("--method {method} --bpw {less:.1}"))?;
        ensure!(fixture.nmse("less.actq")? > 0.02, "{method}: {less} bits suffice, too");
    }
    Ok(())
}

/// Returns the steps of every try, from the table of tries.
fn steps_tried(printed: &str) -> Vec<&str> {
    let cells = printed.lines().skip(1).map(|line| line.split_whitespace().last());
    cells.map_while(|steps| steps).collect()
}

#[test]
fn learning_methods_search_with_few_steps() -> Result<()> {
    let fixture = Fixture::new()?;
    let options = "--method distill --steps 40 --max-nmse 0.05";
    let printed = succeeded(&fixture.quantize(&format!("--out a.actq {options}"))?)?;
    let steps = steps_tried(&printed);
    let looks = steps.iter().take_while(|s| **s == "5").count();
    ensure!((1..=6).contains(&looks) && (1..=5).contains(&(steps.len() - looks)), "{printed}");
    ensure!(steps[looks..].iter().all(|s| *s == "40"), "{printed}");
    ensure!(fixture.nmse("a.actq")? <= 0.05, "{printed}");
    succeeded(&fixture.quantize(&format!("--out b.actq {options} --threads 1"))?)?;
    ensure!(fs::read(fixture.path("a.actq"))? == fs::read(fixture.path("b.actq"))?, "two runs differ");
    // The search ends at the image of 8 bits by rounding, to which the options of learning do not apply.
    succeeded(&fixture.quantize(&format!("--out b.actq {options} --relative"))?)?;
    ensure!(fixture.nmse("b.actq")? <= 0.05, "the limit is not kept");
    // Without steps there is no eighth of them.
    let printed = succeeded(&fixture.quantize("--out c.actq --method distill --steps 0 --max-nmse 0.3")?)?;
    let steps = steps_tried(&printed);
    ensure!(!steps.is_empty() && steps.iter().all(|s| *s == "0"), "{printed}");
    ensure!(fixture.nmse("c.actq")? <= 0.3, "{printed}");
    Ok(())
}

#[test]
fn an_error_below_eight_bits_is_refused() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fixture.files()?;
    for method in ["gptq", "distill --steps 2"] {
        let output =
            fixture.quantize(&format!("--out x.actq --save-stats x.json --method {method} --max-nmse 1e-12"))?;
        failed(&output, 1, &["8 bits", "0.000000000001", "lowest", "NMSE"])?;
    }
    for other in ["--bits 3", "--bpw 3", "--flash 20K"] {
        failed(&fixture.quantize(&format!("--out x.actq --max-nmse 0.1 {other}"))?, 2, &["--max-nmse"])?;
    }
    for wrong in ["0", "-1", "nan", "few"] {
        failed(&fixture.quantize(&format!("--out x.actq --max-nmse={wrong}"))?, 2, &["max-nmse"])?;
    }
    assert_eq!(fixture.files()?, before);
    Ok(())
}

#[test]
fn without_held_out_data_parts_are_held_out() -> Result<()> {
    let fixture = Fixture::new()?;
    let options = "--out x.actq --method rtn --max-nmse 0.02";
    ensure!(succeeded(&fixture.quantize(options)?)?.contains("Measured on heldout.npz."));
    fs::remove_file(fixture.policy().join("heldout.npz"))?;
    ensure!(succeeded(&fixture.quantize(options)?)?.contains("Measured on calib.npz"));
    // A method that learns is measured on frames that it did not learn from.
    let learned = "--out y.actq --method gptq --max-nmse 0.02";
    ensure!(succeeded(&fixture.quantize(learned)?)?.contains(" of calib.npz that it did not learn from."));
    // `eval` reports the same error on that recording.
    fs::rename(fixture.policy().join("calib.npz"), fixture.policy().join("heldout.npz"))?;
    let nmse = fixture.nmse("x.actq")?;
    ensure!(nmse <= 0.02, "{nmse}");
    fs::remove_file(fixture.policy().join("heldout.npz"))?;
    failed(&fixture.quantize(options)?, 1, &["recorded observations", "heldout.npz"])
}
