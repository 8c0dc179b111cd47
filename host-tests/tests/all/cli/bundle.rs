//! `actq import` of a deploy bundle.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use actq::data::{NpzWriter, arrays};
use actq_bench::command::{actq, failed, run, succeeded};
use actq_testkit::{TWO_JOINTS, onnx};
use anyhow::{Result, ensure};
use tempfile::TempDir;

use super::fixture::text;

const TICKS: usize = 12;

pub(super) struct Robot {
    dir: TempDir,
}

impl Robot {
    pub(super) fn new(yaml: &str) -> Result<Self> {
        let robot = Self { dir: TempDir::new()? };
        fs::create_dir(robot.path("bundle"))?;
        fs::write(robot.path("bundle/deploy.yaml"), yaml)?;
        fs::write(robot.path("bundle/policy.onnx"), onnx::linear(8, 2, &[]))?;
        let mut raw = NpzWriter::new(File::create(robot.path("raw.npz"))?);
        let positions = (0..2 * TICKS).map(|i| (0.7 * i as f64).sin());
        raw.array("joint_pos", &[TICKS, 2], positions)?;
        raw.finish()?;
        Ok(robot)
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Returns the command with the bundle, a folder to write and more arguments.
    pub(super) fn import(&self, out: &str, more: &[&str]) -> Command {
        let (bundle, out) = (text(&self.path("bundle")), text(&self.path(out)));
        actq(&[&["import", &bundle, "--out", &out], more].concat())
    }
}

/// Writes what deploy code with that YAML computes, without the program under test.
fn expect(path: &Path, newest_first: bool) -> Result<()> {
    let weights: Vec<f32> = (0..16).map(|i| 0.01 * (1 + i % 7) as f32).collect();
    let (mut before, mut last) = (None, [0.0f32; 2]);
    let (mut observations, mut actions, mut targets) = (Vec::new(), Vec::new(), Vec::new());
    let mut last_before = [0.0f32; 2];
    for tick in 0..TICKS {
        let motor = |i: usize| (0.7 * (2 * tick + i) as f64).sin();
        let term = [motor(1) - 0.5, motor(0) + 0.5].map(|x| (x.clamp(-0.4, 0.4) * 2.0) as f32);
        let old = before.replace(term).unwrap_or(term);
        let frames = if newest_first { [term, old, last, last_before] } else { [old, term, last_before, last] };
        let observation = frames.concat();
        let row = |o: usize| 0.5 + (0..8).map(|i| weights[2 * i + o] * observation[i]).sum::<f32>();
        last_before = last;
        last = [row(0), row(1)];
        observations.extend(observation);
        actions.extend(last);
        targets.extend([last[1] * 0.5 - 0.5, last[0] * 0.25 + 0.5]);
    }
    let mut npz = NpzWriter::new(File::create(path)?);
    for (name, values) in [("observation", observations), ("action", actions), ("target", targets)] {
        npz.array(name, &[TICKS, values.len() / TICKS], values)?;
    }
    npz.finish()?;
    Ok(())
}

#[test]
fn questions_are_asked_until_all_are_answered() -> Result<()> {
    let robot = Robot::new(TWO_JOINTS)?;
    succeeded(&run(robot.import("accepted", &["--accept-profile"]), b"")?)?;
    // A wrong answer is asked for again; an empty line accepts what the deploy code says.
    let answers = format!("sideways\n{}", "\n".repeat(50));
    let output = run(robot.import("asked", &["--ask"]), answers.as_bytes())?;
    let (asked, report) = (String::from_utf8(output.stderr.clone())?, succeeded(&output)?);
    ensure!(asked.matches("history.layout = ").count() >= 2, "{asked}");
    ensure!(
        report.contains("answers, as --answers takes them:\n") && report.contains("history.layout = \"term\"\n"),
        "{report}"
    );
    let description = |folder: &str| -> Result<String> {
        let text = fs::read_to_string(robot.path(folder).join("deploy.toml"))?;
        Ok(text.lines().filter(|line| !line.starts_with('#')).collect())
    };
    ensure!(description("asked")? == description("accepted")?, "the answers made another description");

    let words = ["the input ended before", " was answered; the answers so far"];
    failed(&run(robot.import("ended", &["--ask"]), b"\n")?, 1, &words)?;
    ensure!(!robot.path("ended").exists(), "something was written");
    Ok(())
}

#[test]
fn a_bundle_becomes_a_description_and_an_image() -> Result<()> {
    let robot = Robot::new(TWO_JOINTS)?;
    expect(&robot.path("expect.npz"), false)?;
    let (raw, image) = (text(&robot.path("raw.npz")), text(&robot.path("head.actq")));
    let reference = format!("{raw}:{}", text(&robot.path("expect.npz")));
    let import = ["--accept-profile", "--reference", &reference, "--calib", &raw];
    let report = succeeded(&run(robot.import("out", &import), b"")?)?;
    ensure!(report.contains("12 ticks agree") && report.contains("rate      100 Hz"), "{report}");

    // The description is a bundle of its own.
    let out = text(&robot.path("out"));
    let again = ["import", &out, "--out", &text(&robot.path("again")), "--reference", &reference];
    succeeded(&run(actq(&again), b"")?)?;
    let description = |folder: &str| fs::read_to_string(robot.path(folder).join("deploy.toml"));
    let without_comments = |text: String| text.lines().filter(|line| !line.starts_with('#')).collect::<String>();
    ensure!(without_comments(description("out")?) == without_comments(description("again")?), "it changed");

    let calib = arrays(&robot.path("out/calib.npz"))?;
    ensure!(calib["obs"].shape == [1, TICKS, 8]);
    succeeded(&run(actq(&["quantize", &out, "--method", "rtn", "--bits", "8", "--out", &image]), b"")?)?;
    let inspected = succeeded(&run(actq(&["inspect", &image]), b"")?)?;
    for part in ["100 Hz", "input         joint_pos (2 values)", "positions     target (2 values)", "2 frames"] {
        ensure!(inspected.contains(part), "{part} is not in\n{inspected}");
    }
    let check = ["check", &image, "--reference", &reference, "--max-nmse"];
    let report = succeeded(&run(actq(&[&check[..], &["1e-3"]].concat()), b"")?)?;
    ensure!(report.contains("12 ticks"), "{report}");
    let exact = run(actq(&[&check[..], &["1e-12"]].concat()), b"")?;
    failed(&exact, 1, &["above 1e-12; quantize at more bits"])?;
    // A target without a variance has an error, too, and one that is no number is refused.
    let against = |value: f64, limit: &[&str]| -> Result<Output> {
        let mut npz = NpzWriter::new(File::create(robot.path("other.npz"))?);
        npz.array("target", &[TICKS, 2], (0..2 * TICKS).map(|_| value))?;
        npz.finish()?;
        let other = format!("{}:{}", text(&robot.path("raw.npz")), text(&robot.path("other.npz")));
        run(actq(&[&["check", &image, "--reference", &other], limit].concat()), b"")
    };
    let difference = ["NMSE is inf", "do not drive a robot with this image"];
    failed(&against(1000.0, &["--max-nmse", "1e-3"])?, 1, &difference)?;
    failed(&against(1000.0, &[])?, 1, &difference)?;
    failed(&against(f64::NAN, &[])?, 1, &["other.npz: array \"target\" is NaN at tick 0, value 0"])?;
    for value in ["inf", "-1"] {
        failed(&run(actq(&[&check[..], &[value]].concat()), b"")?, 2, &["use a number above 0"])?;
    }
    // The raw values are an input that no output replaces.
    fs::copy(robot.path("raw.npz"), robot.path("again/calib.npz"))?;
    let raw = text(&robot.path("again/calib.npz"));
    let forced = run(robot.import("again", &["--accept-profile", "--calib", &raw, "--force"]), b"")?;
    failed(&forced, 1, &["is the same file as"])?;
    ensure!(fs::read(robot.path("again/calib.npz"))? == fs::read(robot.path("raw.npz"))?, "the raw values are lost");

    // A recording of raw values makes what the network learns from.
    let recording = recording(&robot)?;
    let quantize = ["quantize", &out, "--calib", &recording, "--bits", "4", "--steps", "5", "--out"];
    let report = succeeded(&run(actq(&[&quantize[..], &[&text(&robot.path("learned.actq"))]].concat()), b"")?)?;
    ensure!(report.contains("240 observations"), "{report}");
    failed(&run(actq(&["eval", &image, "--policy", &out]), b"")?, 1, &["it takes raw inputs"])
}

/// Writes a recording of raw values; returns its path.
pub(super) fn recording(robot: &Robot) -> Result<String> {
    let path = text(&robot.path("recording.npz"));
    let mut npz = NpzWriter::new(File::create(&path)?);
    npz.array("obs", &[2, 120, 2], (0..480).map(|i| (0.3 * i as f32).sin()))?;
    npz.finish()?;
    Ok(path)
}

#[test]
fn deploy_makes_everything_and_keeps_what_is_made() -> Result<()> {
    let robot = Robot::new(TWO_JOINTS)?;
    expect(&robot.path("expect.npz"), false)?;
    let reference = format!("{}:{}", text(&robot.path("raw.npz")), text(&robot.path("expect.npz")));
    let (bundle, out) = (text(&robot.path("bundle")), text(&robot.path("deployed")));
    let base = ["deploy", &bundle, "--out", &out, "--accept-profile"];
    failed(&run(actq(&base), b"")?, 1, &["give --recordings"])?;
    ensure!(!robot.path("deployed").exists(), "something was written");

    let recording = recording(&robot)?;
    let all = [&base[..], &["--reference", &reference, "--recordings", &recording, "--steps", "5"]].concat();
    let report = succeeded(&run(actq(&all), b"")?)?;
    for part in [
        "1. import",
        "12 ticks agree",
        "2. quantize",
        "240 observations",
        "3. check the image",
        "largest error",
        "4. constants",
    ] {
        ensure!(report.contains(part), "{part} is not in\n{report}");
    }
    let image = fs::read(robot.path("deployed/policy.actq"))?;
    let report = succeeded(&run(actq(&all), b"")?)?;
    for part in ["deploy.toml: kept", "made before with the same options", "largest error"] {
        ensure!(report.contains(part), "{part} is not in\n{report}");
    }
    // The report has the names of the trained matrices and how the image was made.
    let [deployed, page] = ["deployed/policy.actq", "report.html"].map(|file| text(&robot.path(file)));
    let stats = text(&robot.path("deployed/policy.stats.json"));
    succeeded(&run(actq(&["report", &deployed, "--stats", &stats, "--out", &page, "--quiet"]), b"")?)?;
    let html = fs::read_to_string(&page)?;
    ensure!(html.contains("[\"method\",\"distill\"]") && !html.contains("\"name\":\"matrix 0\""), "{page}");
    // Other answers are not taken for those of the import, and no other policy is put into its folder.
    let answers = text(&robot.path("answers.toml"));
    fs::write(&answers, "")?;
    failed(&run(actq(&[&all[..], &["--answers", &answers]].concat()), b"")?, 1, &["has changed since", "--answers"])?;
    let (folder, onnx) = (text(&robot.path("deployed/policy")), text(&robot.path("bundle/policy.onnx")));
    failed(&run(actq(&["import", &onnx, "--out", &folder]), b"")?, 1, &["deploy.toml", "another policy"])?;
    for (file, part) in
        [("policy.rs", "pub const TARGET_TARGET: usize = 0;"), ("policy.h", "#define POLICY_STIFFNESS {10.0f, 20.0f}")]
    {
        let source = fs::read_to_string(robot.path("deployed").join(file))?;
        ensure!(source.contains(part), "{part} is not in {file}:\n{source}");
    }
    // A description that is kept is compared with the reference, and its bundle must be there.
    expect(&robot.path("wrong.npz"), true)?;
    let wrong = format!("{}:{}", text(&robot.path("raw.npz")), text(&robot.path("wrong.npz")));
    let line = ["deploy", &bundle, "--out", &out, "--accept-profile", "--recordings", &recording, "--steps", "5"];
    failed(&run(actq(&[&line[..], &["--reference", &wrong]].concat()), b"")?, 1, &["differs"])?;
    let gone = text(&robot.path("gone"));
    failed(&run(actq(&[&["deploy", &gone], &line[2..]].concat()), b"")?, 1, &["gone"])?;
    failed(&run(actq(&[&line[..], &["--max-nmse", "1"]].concat()), b"")?, 2, &["--reference"])?;
    // A bundle that has changed is not taken for the one that was imported.
    let yaml = robot.path("bundle/deploy.yaml");
    let before = fs::read_to_string(&yaml)?;
    fs::write(&yaml, before.clone() + "\n")?;
    let remedy = "deploy.yaml; remove";
    failed(&run(actq(&all), b"")?, 1, &["has changed since", remedy, "import the bundle again"])?;
    fs::write(&yaml, before)?;
    // Another option makes another image.
    let report = succeeded(&run(actq(&[&all[..], &["--bpw", "20"]].concat()), b"")?)?;
    ensure!(!report.contains("made before") && fs::read(robot.path("deployed/policy.actq"))? != image, "{report}");
    // An image that an interrupted run leaves is not that of the record.
    fs::write(robot.path("deployed/policy.actq"), &image)?;
    let report = succeeded(&run(actq(&[&all[..], &["--bpw", "20"]].concat()), b"")?)?;
    ensure!(!report.contains("made before") && fs::read(robot.path("deployed/policy.actq"))? != image, "{report}");
    let exact = run(actq(&[&all[..], &["--bpw", "19", "--max-nmse", "1e-12"]].concat()), b"")?;
    failed(&exact, 1, &["quantize at more bits"])?;
    ensure!(!robot.path("deployed/policy.h").exists(), "the constants of another image stay");
    Ok(())
}

#[test]
fn a_difference_from_the_reference_is_explained() -> Result<()> {
    let robot = Robot::new(TWO_JOINTS)?;
    expect(&robot.path("expect.npz"), true)?;
    let reference = format!("{}:{}", text(&robot.path("raw.npz")), text(&robot.path("expect.npz")));
    let words = [
        "tick 1, observation: joint_pos_rel[1] of the tick before",
        "it agrees if histories begin with the newest frame.",
    ];
    failed(&run(robot.import("out", &["--accept-profile", "--reference", &reference]), b"")?, 1, &words)?;
    ensure!(!robot.path("out").exists(), "something was written");

    fs::write(robot.path("answers.toml"), "[history]\nfirst = \"newest\"\n")?;
    let answers = text(&robot.path("answers.toml"));
    let import = ["--accept-profile", "--answers", &answers, "--reference", &reference];
    succeeded(&run(robot.import("out", &import), b"")?)?;
    Ok(())
}
