//! Policies: human-readable keys change nothing, and no content controls the terminal. Faults are cases of `crates/actq-cli/tests`.

use std::fs;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::methods::{Method, Options};
use actq::pipeline;
use actq::policy::Policy;
use actq_bench::command::{actq, failed, run, succeeded};
use actq_kernels::Width;
use actq_testkit::f32_tensors;
use anyhow::{Result, ensure};
use serde_json::{Value, json};

use super::fixture::{Fixture, description, edit, tensors, text, write_json, write_tensors};

/// Keys with which an exporter describes a policy to people.
#[test]
fn human_readable_keys_change_nothing() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fs::read(fixture.image("")?)?;
    let mut json = description();
    for (key, value) in [("source", "a\nb"), ("commit", ""), ("source_path", "x.pt"), ("license", "MIT")] {
        json[key] = value.into();
    }
    (json["recurrent"], json["n_params"]) = (json!(false), json!(12345));
    write_json(&fixture.policy(), &json)?;
    let after = fs::read(fixture.image("")?)?;
    // The folder's digest differs, and with it the checksum.
    assert_eq!(before[128..], after[128..]);
    Ok(())
}

#[test]
fn file_content_cannot_control_the_terminal() -> Result<()> {
    let fixture = Fixture::new()?;
    // No image holds such a name.
    let mut policy = Policy::load(&fixture.policy())?;
    policy.name = "arm\x1b[2J\nmatrix\u{9b}".to_owned();
    let options = Options::new(Method::Rtn, Budget::Width(Width::W4));
    let refused = pipeline::quantize(&policy, &Recordings::default(), &options, ()).map(|_| ());
    ensure!(format!("{:#}", refused.expect_err("a name")).contains("control characters"));

    // The names of tensors in a message, and those of matrices in statistics.
    fs::write(fixture.policy().join("policy.safetensors"), f32_tensors([("w\x1b[2J", [1], [0.0])]))?;
    let output = fixture.quantize(&fixture.out("other.actq"), "")?;
    failed(&output, 1, &["the file holds w\\u{1b}[2J"])?;
    ensure!(!output.stderr.contains(&0x1b), "{:?}", String::from_utf8_lossy(&output.stderr));
    write_tensors(&fixture.policy(), &tensors())?;
    let (named, stats) = (fixture.out("stats.actq"), fixture.out("stats.json"));
    succeeded(&fixture.quantize(&named, &format!("--save-stats {}", text(&stats)))?)?;
    fs::write(&stats, fs::read_to_string(&stats)?.replace("mid.weight", "mid\\u001b[2J\\n.weight"))?;
    let report = run(actq(&["inspect", &text(&named), "--widths", "--stats", &text(&stats)]), b"")?;
    ensure!(succeeded(&report)?.contains("mid\\u{1b}[2J\\n.weight"), "{:?}", String::from_utf8_lossy(&report.stdout));
    Ok(())
}

/// Like an exporter that writes every key.
#[test]
fn a_key_without_value_counts_as_absent() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fs::read(fixture.image("")?)?;
    edit(&fixture.policy(), "/ops/2/clip", Value::Null)?;
    let after = fs::read(fixture.image("")?)?;
    // The folder's digest differs, and with it the checksum.
    assert_eq!(before[128..], after[128..]);
    Ok(())
}
