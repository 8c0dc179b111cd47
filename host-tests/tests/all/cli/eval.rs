//! `actq eval`: its figures, and the recordings that it accepts.

use std::fs::{self, File};
use std::path::Path;

use actq::data::NpzWriter;
use actq_bench::command::{actq, failed, run, succeeded};
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use serde_json::{Value, json};

use super::fixture::{
    ACT, CHUNK, EPISODES, Fixture, OBS, STEPS, draw_observations, edit, notes, text, write_npy, write_recording,
};

#[test]
fn eval_prints_one_object_with_six_numbers() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("--bits 8")?;
    let report = fixture.eval(&path)?;
    let keys: Vec<_> = report.as_object().context("no object")?.keys().map(String::as_str).collect();
    let mut expected = ["nmse", "worst_nmse", "max_abs", "steps", "bpw", "bytes"];
    expected.sort_unstable();
    assert_eq!(keys, expected);
    assert_eq!(report["steps"], json!(2 * STEPS + 7));
    assert_eq!(report["bytes"], json!(fs::metadata(&path)?.len()));
    let number = |key: &str| report[key].as_f64().with_context(|| format!("{key} is not a number"));
    ensure!(number("nmse")? > 0.0 && number("nmse")? <= number("worst_nmse")? && number("worst_nmse")? < 1e-2);
    ensure!(number("max_abs")? > 0.0 && number("bpw")? > 8.0);
    let people = run(actq(&["eval", &text(&path), "--policy", &text(&fixture.policy())]), b"")?;
    ensure!(succeeded(&people)?.contains("nmse"), "the human-readable report lacks the error");
    Ok(())
}

#[test]
fn eval_names_the_fault_of_a_recording() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("")?);
    let path = fixture.policy().join("heldout.npz");
    let (obs, full) = (draw_observations(1, OBS), [STEPS as i64; EPISODES]);
    let action = |width| Array3::<f32>::zeros((EPISODES, STEPS, width));
    let eval = |words: &[&str]| {
        let output = run(actq(&["eval", &image, "--policy", &text(&fixture.policy()), "--json"]), b"")?;
        ensure!(output.stdout.is_empty(), "the command printed to standard output");
        failed(&output, 1, words)
    };
    write_recording(&path, &obs, Some(&action(ACT)), full)?;
    eval(&["heldout.npz", "action"]).context("actions of another width")?;
    write_recording(&path, &draw_observations(1, OBS - 1), Some(&action(CHUNK * ACT)), full)?;
    eval(&["heldout.npz", "obs"]).context("observations of another width")?;
    write_recording(&path, &obs, Some(&action(CHUNK * ACT)), full)?;
    let alone = run(actq(&["eval", &image, "--heldout", &text(&path), "--json"]), b"")?;
    failed(&alone, 1, &["heldout.npz", "vary"]).context("actions that never vary, without the policy")?;
    let other = Array3::from_shape_fn((EPISODES, STEPS, CHUNK * ACT), |(e, t, i)| ((7 * e + 3 * t + i) as f32).sin());
    write_recording(&path, &obs, Some(&other), full)?;
    let alone = run(actq(&["eval", &image, "--heldout", &text(&path), "--json"]), b"")?;
    let found = notes(&alone).context("actions of another policy")?;
    ensure!(found.iter().any(|note| note.ends_with("do not drive a robot with this image")), "{found:?}");
    let with_policy = run(actq(&["eval", &image, "--policy", &text(&fixture.policy()), "--json"]), b"")?;
    let found = notes(&with_policy).context("the error is measured against the policy")?;
    let said = "heldout.npz: the recorded actions are not the policy's";
    ensure!(found.iter().any(|note| note.contains(said)), "{found:?}");
    ensure!(!found.iter().any(|note| note.contains("do not drive")), "{found:?}");
    let report: Value = serde_json::from_str(&succeeded(&with_policy)?)?;
    ensure!(report["nmse"].as_f64().is_some_and(|nmse| nmse < 0.1), "{report}");
    write_recording(&path, &obs, Some(&action(CHUNK * ACT)), [0; EPISODES])?;
    eval(&["heldout.npz"]).context("no steps")?;
    fs::remove_file(&path)?;
    eval(&["heldout.npz"]).context("no recording")
}

#[test]
fn eval_labels_a_named_recording_by_its_policy() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("--bits 4")?);
    let policy = text(&fixture.policy());
    let heldout = fixture.policy().join("heldout.npz");
    let named = fixture.out("drive.npz");
    fs::rename(&heldout, &named)?;
    let eval = |arguments: &[&str]| run(actq(&[&["eval", &image, "--json"], arguments].concat()), b"");
    let expected = succeeded(&eval(&["--heldout", &text(&named)])?)?;
    assert_eq!(serde_json::from_str::<Value>(&expected)?["steps"], json!(2 * STEPS + 7));
    failed(
        &eval(&["--policy", &policy])?,
        1,
        &["actq eval needs recorded observations: put heldout.npz, heldout.npy or heldout.safetensors", "--heldout"],
    )?;
    failed(&eval(&[])?, 2, &["<POLICY_DIR>"])?;
    // Observations only: the image's own policy computes the actions; another one is refused.
    write_recording(&heldout, &draw_observations(6, OBS), None, [STEPS as i64, 7, STEPS as i64])?;
    assert_eq!(succeeded(&eval(&["--policy", &policy])?)?, expected);
    failed(&eval(&["--heldout", &text(&heldout)])?, 1, &["heldout.npz: array \"action\" is missing", "--policy"])?;
    fs::remove_file(&heldout)?;
    write_npy(&fixture.policy().join("heldout.npy"), &draw_observations(6, OBS))?;
    let all: Value = serde_json::from_str(&succeeded(&eval(&["--policy", &policy])?)?)?;
    assert_eq!(all["steps"], json!(EPISODES * STEPS));
    edit(&fixture.policy(), "/control_hz", json!(26))?;
    let edited = eval(&["--policy", &policy])?;
    failed(&edited, 1, &["was made from another policy", "heldout.npy: array \"action\" is missing"])?;
    let file = text(&fixture.policy().join("policy.json"));
    failed(&eval(&["--policy", &file])?, 1, &["policy.json: not a folder"])?;
    fs::write(&file, "{broken")?;
    failed(&eval(&["--policy", &policy])?, 1, &["policy.json"])?;
    failed(&eval(&["--policy", &text(&fixture.out("none"))])?, 1, &["there is no such folder"])
}

/// A recording shows by the image's checksum which image it is a rollout of, if it shows it at all.
#[test]
fn recordings_of_no_rollout_are_refused_or_noted() -> Result<()> {
    let fixture = Fixture::new()?;
    let (image, policy) = (text(&fixture.image("--bits 4")?), text(&fixture.policy()));
    let eval = |driven: &Path| run(actq(&["eval", &image, "--policy", &policy, "--driven", &text(driven)]), b"");
    for (name, array, shape, message) in [
        ("two.npz", "crc32", &[2][..], "two.npz: array \"crc32\" is not one int64, the CRC-32 of an image"),
        ("log.npz", "applied", &[EPISODES * STEPS], "log.npz: is a log of actq link stream"),
    ] {
        let path = fixture.out(name);
        let mut npz = NpzWriter::new(File::create(&path)?);
        let obs = draw_observations(6, OBS);
        npz.array("obs", &[EPISODES * STEPS, OBS], obs.iter().copied())?;
        npz.array(array, shape, (0..shape[0]).map(|_| 1i64))?;
        npz.finish()?;
        failed(&eval(&path)?, 1, &[message])?;
    }
    let notes = notes(&eval(&fixture.policy().join("calib.npz"))?)?;
    ensure!(notes.iter().any(|note| note.contains("calib.npz: the file names no image")), "{notes:?}");
    Ok(())
}
