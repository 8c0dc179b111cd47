//! Statistics of an image, the widths that `actq inspect` shows, the search for the fewest bits, and the files of a
//! sweep.

mod fixture;
mod search;
mod sweep;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use actq::budget::Budget;
use actq::calibrate::equalize::equalized;
use actq::data::Recordings;
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::pipeline::stats::{AllocationRecord, MatrixRecord, Stats};
use actq::policy::Policy;
use actq_bench::command::{actq, all, failed, run, succeeded};
use actq_bench::{root, ur3};
use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use fixture::{Fixture, HIDDEN, IDLE};

fn parsed(value: &Value) -> Result<Stats> {
    Ok(serde_json::from_value(value.clone())?)
}

fn allocation(matrix: &MatrixRecord) -> Result<&AllocationRecord> {
    matrix.allocation.as_ref().with_context(|| format!("{} has no allocation", matrix.name))
}

#[test]
fn statistics_sum_to_the_image_and_explain_widths() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = fixture.path("ur3.actq");
    let (image, file) = (image.display().to_string(), fixture.path("ur3.json"));
    let policy = ur3().display().to_string();
    let options = ["--bpw", "2", "--steps", "200", "--seed", "7"];
    let mut command = actq(&["quantize", &policy, "--out", &image, "--save-stats", &file.display().to_string()]);
    command.args(options);
    let printed = succeeded(&run(command, b"")?)?;
    let stats = parsed(&serde_json::from_slice(&fs::read(&file)?)?)?;
    assert_eq!((stats.policy.as_str(), stats.method.as_str()), ("ur3_reach", "distill"));
    assert_eq!((stats.seed, stats.steps, stats.bytes as u64), (7, 200, fs::metadata(&image)?.len()));
    let weights: usize = stats.matrices.iter().map(|m| m.rows * m.cols).sum();
    let bytes: usize = stats.matrices.iter().map(|m| m.bytes).sum();
    assert!((stats.bpw - 8.0 * (bytes + stats.balance) as f64 / weights as f64).abs() < 1e-9);
    for matrix in &stats.matrices {
        // Bits exclude only padding and block records; these are largest at 18 columns.
        let (bits, least) = (matrix.bits.iter().sum::<usize>(), if matrix.cols == 18 { 0.7 } else { 0.9 });
        let share = bits as f64 / (8.0 * matrix.bytes as f64);
        ensure!(share > least && share < 1.0, "{bits} bits in {} bytes", matrix.bytes);
        let allocation = allocation(matrix)?;
        // A width costs the same share of every row's energy, and wider ones less.
        let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
        for (r, &width) in matrix.widths.iter().enumerate() {
            let expected = allocation.expected[r];
            if width == 0 {
                assert_eq!((expected, matrix.bits[r]), (allocation.removal[r], 0));
                continue;
            }
            let share = expected / allocation.energy[r];
            let known = *shares.entry(width).or_insert(share);
            ensure!((share / known - 1.0).abs() < 1e-9, "{share} and {known} at {width} bits");
        }
        ensure!(shares.values().is_sorted_by(|a, b| a > b), "{shares:?}");
        ensure!(allocation.importance.iter().all(|h| *h > 0.0));
    }
    // All matrices but the last make elements of one residual stream: they lose the same ones, and the others keep
    // their order.
    let [first, blocks @ .., last] = &stats.matrices[..] else { bail!("fewer than two matrices") };
    ensure!(last.image_rows.iter().copied().eq(0..last.rows));
    ensure!(first.image_rows.is_sorted() && blocks.iter().all(|m| m.image_rows == first.image_rows));
    let removed = first.rows - first.image_rows.len();
    let text = format!("\n{removed} of the {} neurons of layer 1 ({}) removed\n", first.rows, first.name);
    ensure!(removed > 0 && printed.contains(&text) && printed.contains("\nTook "), "{printed}");
    Ok(())
}

#[test]
fn image_rows_map_to_policy_rows() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = Policy::load(&fixture.policy())?;
    let options = Options { steps: Some(200), ..Options::new(Method::Distill, Budget::BitsPerWeight(4.0)) };
    let recordings = Recordings::load(&policy)?;
    let outcomes = quantize(&policy, &recordings, &options, ())?.outcomes;
    let mut removed = Vec::new();
    for (source, outcome) in equalized(&policy.graph, recordings.calib.as_ref()).matrices.iter().zip(&outcomes) {
        let allocation = outcome.allocation.as_ref().context("an allocation")?;
        let values = outcome.quantized.dequantized();
        for (row, &from) in values.chunks_exact(outcome.quantized.cols).zip(&allocation.rows) {
            let trained: Vec<f32> = allocation.columns.iter().map(|&c| source.data[from * source.cols + c]).collect();
            let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
            let cosine = dot(row, &trained) / (dot(row, row) * dot(&trained, &trained)).sqrt();
            ensure!(cosine > 0.8, "{}: row {from} does not match, cosine {cosine}", source.name);
        }
        removed.push((0..source.rows).filter(|r| !allocation.rows.contains(r)).collect::<Vec<_>>());
    }
    ensure!(IDLE.iter().all(|r| removed[0].contains(r)), "{removed:?} are gone");
    ensure!(removed[2].is_empty() && outcomes[0].quantized.rows == HIDDEN - removed[0].len());
    Ok(())
}

#[test]
fn every_method_saves_its_statistics() -> Result<()> {
    let fixture = Fixture::new()?;
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(1.0);
    for method in ["rtn", "gptq", "actquant"] {
        let value = fixture.image(method, &format!("--method {method} --bpw 6"))?;
        assert_eq!(value["budget"], json!({"bits_per_weight": 6.0}));
        let stats = parsed(&value)?;
        assert_eq!((stats.method.as_str(), stats.steps), (method, 0));
        for matrix in &stats.matrices {
            ensure!(matrix.error.is_some_and(|e| e > 0.0 && e < 0.2) && matrix.allocation.is_none());
            ensure!(matrix.widths.iter().all(|w| *w == matrix.widths[0]) && matrix.widths.len() == matrix.rows);
            assert_eq!(matrix.score.is_some(), method == "actquant");
            if let Some(s) = &matrix.score {
                ensure!(same(s["sens"], s["f_output"] - s["f_input"]), "{s:?}");
                ensure!(same(s["f_input"], s["y_input"] - s["x_input"]), "{s:?}");
            }
        }
    }
    assert_eq!(fixture.image("width", "--method gptq --bits 3")?["budget"], json!({"width": 3}));
    assert_eq!(fixture.image("flash", "--method gptq --flash 4K")?["budget"], json!({"image_bytes": 4096}));
    Ok(())
}

#[test]
fn inspect_shows_every_row() -> Result<()> {
    let fixture = Fixture::new()?;
    let stats = parsed(&fixture.image("leg", "--bpw 4 --steps 2")?)?;
    let plain = succeeded(&fixture.actq("inspect leg.actq --widths")?)?;
    let full = succeeded(&fixture.actq("inspect leg.actq --widths --stats leg.json")?)?;
    let strips = |text: &str| -> Vec<String> {
        let strip = |line: &&str| line.starts_with("  ") && !line.trim().contains(|c: char| !".2348".contains(c));
        text.lines().filter(strip).map(|line| line.trim().to_owned()).collect()
    };
    let letter = |width: &u32| if *width == 0 { '.' } else { char::from_digit(*width, 10).unwrap_or('?') };
    let trained: Vec<String> = stats.matrices.iter().map(|m| m.widths.iter().map(letter).collect()).collect();
    assert_eq!(strips(&full), trained);
    ensure!(IDLE.iter().all(|r| trained[0].as_bytes()[*r] == b'.'), "{trained:?}");
    let in_image =
        stats.matrices.iter().map(|m| m.image_rows.iter().map(|r| letter(&m.widths[*r])).collect::<String>());
    assert_eq!(strips(&plain), in_image.collect::<Vec<_>>());
    ensure!(
        plain.contains("matrix 0") && !plain.contains("energy") && full.contains("first") && full.contains("energy")
    );
    // Shares are of the whole, so they add up.
    let shares = |text: &str, column: usize| -> f64 {
        let cells = text.lines().filter_map(|line| line.split_whitespace().filter(|c| c.ends_with('%')).nth(column));
        cells.filter_map(|c| c.trim_end_matches('%').parse::<f64>().ok()).sum()
    };
    for (text, column) in [(&plain, 0), (&full, 0), (&full, 1)] {
        ensure!((shares(text, column) - 100.0).abs() < 1.0, "{} in\n{text}", shares(text, column));
    }
    Ok(())
}

#[test]
fn statistics_of_another_image_are_refused() -> Result<()> {
    let fixture = Fixture::new()?;
    let good = fixture.image("one", "--bits 3 --method gptq")?;
    fixture.image("two", "--bits 4 --method gptq")?;
    let write = |name: &str, value: &Value| fs::write(fixture.path(name), value.to_string());
    let edited = |pointer: &str, to: Value| {
        let mut value = good.clone();
        value.pointer_mut(pointer).map(|place| *place = to).with_context(|| pointer.to_owned())?;
        Ok::<_, anyhow::Error>(value)
    };
    write("schema.json", &edited("/schema", json!("actq-stats-0"))?)?;
    write("none.json", &json!([1, 2]))?;
    write("short.json", &edited("/matrices/1/widths", json!([3, 3]))?)?;
    write("widths.json", &edited("/matrices/1/widths/5", json!(8))?)?;
    write("rows.json", &edited("/matrices/1/image_rows/0", json!(1000))?)?;
    write("fewer.json", &edited("/matrices", json!([good["matrices"][0]]))?)?;
    write("text.json", &edited("/matrices/0/bytes", json!("many"))?)?;
    fs::write(fixture.path("cut.json"), &good.to_string()[..300])?;
    let before = fixture.files()?;
    let cases: [(&str, &[&str]); 10] = [
        ("two", &["two.json", "another image", "crc32"]),
        ("gone", &["gone.json", "cannot read the file"]),
        ("schema", &["schema.json", "actq-stats-0", "actq-stats-1"]),
        ("none", &["none.json", "schema"]),
        ("short", &["short.json", "second"]),
        ("widths", &["second", "widths"]),
        ("rows", &["rows.json", "second"]),
        ("fewer", &["1 matrices", "3"]),
        ("text", &["text.json", "actq-stats-1"]),
        ("cut", &["cut.json", "JSON"]),
    ];
    all(cases.map(|(name, words)| {
        let line = format!("inspect one.actq --widths --stats {name}.json");
        let refused = fixture.actq(&line).and_then(|output| {
            ensure!(output.stdout.is_empty(), "the command printed to standard output");
            failed(&output, 1, words)
        });
        (name.to_owned(), refused)
    }))?;
    assert_eq!(fixture.files()?, before);
    failed(&fixture.actq("inspect one.actq --stats one.json")?, 2, &["widths"])
}

#[test]
fn image_and_statistics_are_written_together_or_not() -> Result<()> {
    let fixture = Fixture::new()?;
    fs::create_dir(fixture.path("folder"))?;
    let before = fixture.files()?;
    let cases = [("x.actq", "none/x.json"), ("x.actq", "folder"), ("none/x.actq", "x.json"), ("folder", "x.json")];
    all(cases.map(|(image, stats)| {
        let wrong = if image == "x.actq" { stats } else { image };
        let output = fixture.quantize(&format!("--bits 3 --method rtn --out {image} --save-stats {stats}"));
        (format!("{image} {stats}"), output.and_then(|output| failed(&output, 1, &[wrong, "cannot write the file"])))
    }))?;
    failed(&fixture.quantize("--bits 3 --method rtn --out x.actq --save-stats x.actq")?, 1, &["x.actq"])?;
    assert_eq!(fixture.files()?, before);
    Ok(())
}

/// The fields of the documented schema, so that document and code agree.
#[test]
fn every_field_is_documented() -> Result<()> {
    let fixture = Fixture::new()?;
    let text = fs::read_to_string(Path::new(root()).join("docs/QUANTIZER.md"))?;
    let mut values = vec![
        fixture.image("distill", "--bpw 4 --steps 2")?,
        fixture.image("actquant", "--bpw 6 --method actquant")?,
        fixture.image("width", "--bits 3 --method rtn")?,
        fixture.image("bytes", "--flash 4K --method rtn")?,
        fixture.image("error", "--max-nmse 0.1 --method rtn")?,
    ];
    let mut missing = Vec::new();
    while let Some(value) = values.pop() {
        match value {
            Value::Object(map) => {
                missing.extend(map.keys().filter(|key| !text.contains(&format!("`{key}`"))).cloned());
                values.extend(map.into_iter().map(|(_, v)| v));
            }
            Value::Array(array) if array.first().is_some_and(Value::is_object) => values.extend(array),
            _ => {}
        }
    }
    ensure!(missing.is_empty(), "not in docs/QUANTIZER.md: {missing:?}");
    Ok(())
}
