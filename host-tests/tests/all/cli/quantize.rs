//! `actq quantize`: budgets, methods and recordings, and its messages about them.

use std::fs;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, failed, research, run, succeeded};
use actq_kernels::Width;
use actq_testkit::{Dtype, safetensors};
use anyhow::{Context, Result, ensure};
use serde_json::Value;

use super::fixture::{
    ACT, CHUNK, EPISODES, Fixture, HIDDEN, OBS, STEPS, cut, draw_observations, notes, text, write_npy, write_recording,
};

#[test]
fn a_budget_of_time_is_kept_or_refused() -> Result<()> {
    let fixture = Fixture::new()?;
    let (policy, out) = (text(&fixture.policy()), text(&fixture.out("timed.actq")));
    let quantize = |arguments: &[&str]| {
        run(actq(&[&["quantize", &policy, "--out", &out, "--method", "rtn", "--clock", "1M"], arguments].concat()), b"")
    };
    let time = || -> Result<f64> {
        let json = succeeded(&run(actq(&["inspect", &out, "--json", "--clock", "1M"]), b"")?)?;
        serde_json::from_str::<Value>(&json)?["milliseconds"].as_f64().context("no milliseconds")
    };
    ensure!(succeeded(&quantize(&["--ms", "1000"])?)?.contains("Predicted time of a step"), "the time is not printed");
    let slowest = time()?;
    let refused = quantize(&["--ms", "0.001"])?;
    failed(&refused, 1, &["the limit is 0.001 ms", "the fastest step takes", "1 MHz"])?;
    let limit = 0.98 * slowest;
    let kept = quantize(&["--ms", &limit.to_string()])?;
    succeeded(&kept)?;
    ensure!(time()? <= limit, "{} ms, limit {limit}", time()?);
    Ok(())
}

#[test]
fn relative_errors_change_the_image() -> Result<()> {
    let fixture = Fixture::with_long_recording()?;
    let (policy, out) = (text(&fixture.policy()), text(&fixture.out("relative.actq")));
    let quantize = |arguments: &[&str]| {
        run(actq(&[&["quantize", &policy, "--out", &out, "--bpw", "2.5"], arguments].concat()), b"")
    };
    // As many steps as learning needs to be kept.
    succeeded(&quantize(&["--steps", "1000"])?)?;
    let even = fs::read(&out)?;
    succeeded(&quantize(&["--steps", "1000", "--relative"])?)?;
    ensure!(fs::read(&out)? != even, "the option changes nothing");
    Ok(())
}

/// The widths of an image's matrices, narrow to wide.
fn widths(path: &Path) -> Result<Vec<u32>> {
    let buffer = ImageBuffer::read(path)?;
    let matrices = buffer.image(path)?.ops().filter_map(|op| op.matrix());
    let mut widths: Vec<u32> = matrices.flat_map(|m| m.blocks().map(|rows| rows.block.shape().width.bits())).collect();
    widths.sort_unstable();
    Ok(widths)
}

#[test]
fn every_width_reaches_the_image() -> Result<()> {
    let fixture = Fixture::new()?;
    let mut last = (f64::INFINITY, 0.0);
    for width in Width::ALL {
        let bits = width.bits();
        let path = fixture.image(&format!("--bits {bits}"))?;
        assert_eq!(widths(&path)?, [bits; 3]);
        let report = fixture.eval(&path)?;
        let (nmse, bpw) = (report["nmse"].as_f64().context("nmse")?, report["bpw"].as_f64().context("bpw")?);
        ensure!(nmse < last.0 && bpw > last.1 && bpw >= f64::from(bits), "{bits} bits: nmse {nmse}, {bpw} bits/weight");
        last = (nmse, bpw);
    }
    Ok(())
}

#[test]
fn a_budget_is_kept_and_used() -> Result<()> {
    let fixture = Fixture::new()?;
    let mut errors = Vec::new();
    for budget in [3.1, 3.7, 4.2, 4.9, 6.0, 7.3, 12.0] {
        let path = fixture.image(&format!("--bpw {budget}"))?;
        let report = fixture.eval(&path)?;
        let bpw = report["bpw"].as_f64().context("bpw")?;
        ensure!(bpw <= budget + 1e-9, "--bpw {budget} gave {bpw}");
        errors.push((budget, report["nmse"].as_f64().context("nmse")?));
    }
    ensure!(errors.windows(2).all(|pair| pair[1].1 <= pair[0].1), "more bits, more error: {errors:?}");
    assert_eq!(widths(&fixture.out("--bpw 12.actq"))?, [8; 3]);
    Ok(())
}

#[test]
fn too_small_a_budget_names_the_least() -> Result<()> {
    let fixture = Fixture::new()?;
    let narrowest = fixture.eval(&fixture.image("--bits 2")?)?["bpw"].as_f64().context("bpw")?;
    let before = fixture.snapshot()?;
    let output = fixture.quantize(&fixture.out("small.actq"), "--bpw 2.0")?;
    let weights = HIDDEN * OBS + HIDDEN * HIDDEN + CHUNK * ACT * HIDDEN;
    let bytes = (narrowest * weights as f64 / 8.0).round();
    failed(&output, 1, &["budget", &format!("{bytes} bytes")])?;
    ensure!(fixture.snapshot()? == before, "files changed");
    // The least budget itself is enough.
    fixture.image(&format!("--bpw {}", narrowest + 1e-6))?;
    Ok(())
}

#[test]
fn an_unused_budget_is_explained() -> Result<()> {
    let fixture = Fixture::new()?;
    let first_note = |options: &str| -> Result<String> {
        let notes = notes(&fixture.quantize(&fixture.out("image.actq"), options)?)?;
        Ok(notes.into_iter().next().unwrap_or_default())
    };
    let bytes = fs::metadata(fixture.image("--bits 8")?)?.len();
    assert_eq!(
        first_note("--flash 1M")?,
        format!(
            "note: the image uses {bytes} of 1048576 bytes: every row has the most bits that a row can have; a smaller budget \
             gives the same image"
        )
    );
    let step = first_note("--bpw 7")?;
    ensure!(step.contains(" of 7 bits per weight: the next step of bits takes more than the rest"), "{step}");
    Ok(())
}

#[test]
fn the_default_method_depends_on_the_recordings() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.out("default.actq");
    let bytes = |options: &str| Ok::<_, anyhow::Error>(fs::read(fixture.image(options)?)?);
    let default = |options: &str| {
        succeeded(&fixture.quantize_as_given(&out, options)?)?;
        Ok::<_, anyhow::Error>(fs::read(&out)?)
    };
    let rtn = bytes("--bits 3 --method rtn --activations 8")?;
    // With a recording: the method that learns, which names the number of frames that it needs.
    failed(&fixture.quantize_as_given(&out, "")?, 1, &["calib.npz", "frames", "200"])?;
    fs::remove_file(fixture.policy().join("calib.npz"))?;
    assert_eq!(default("")?, rtn);
    Ok(())
}

#[test]
fn groups_and_activations_reach_the_image() -> Result<()> {
    let fixture = Fixture::new()?;
    for (group, activations) in [(0, 8), (32, 16), (64, 8), (128, 16)] {
        let path = fixture.image(&format!("--group {group} --activations {activations}"))?;
        let buffer = ImageBuffer::read(&path)?;
        for matrix in buffer.image(&path)?.ops().filter_map(|op| op.matrix()) {
            assert_eq!((matrix.group, matrix.x_max > 127), (group, activations == 16));
        }
        fixture.eval(&path)?;
    }
    Ok(())
}

#[test]
fn choices_of_actquant_reach_the_image() -> Result<()> {
    let fixture = Fixture::new()?;
    let (policy, out) = (fixture.policy(), fixture.out("image.actq"));
    let quantize = |options: &str| {
        let mut command = research(&["quantize"]);
        command.arg(&policy).arg("--out").arg(&out).args(options.split_whitespace());
        run(command, b"")
    };
    let image = |choices: &str| -> Result<Vec<u8>> {
        succeeded(&quantize(&format!("--method actquant --bpw 4 {choices}"))?)?;
        Ok(fs::read(&out)?)
    };
    let plain = image("")?;
    let defaults =
        "bandwidth=median,frames=512,score=gain,noise=codes,widest=8,head=free,samples=4096,batch=1,signs=random";
    ensure!(image(&format!("--actquant {defaults},magnitude=no"))? == plain, "these are the defaults");
    for choices in ["magnitude=yes", "samples=16"] {
        ensure!(image(&format!("--actquant {choices}"))? != plain, "{choices} changes nothing");
    }

    fs::remove_file(&out)?;
    for (options, status, words) in [
        ("--method gptq --actquant authors", 1, "--actquant has no effect on gptq"),
        ("--actquant authors", 1, "no effect on distill"),
        ("--method actquant --actquant heads=8", 2, "heads is not a key; the keys are bandwidth, frames"),
        ("--method actquant --actquant head=5", 2, "head takes 2, 3, 4 or 8, or free"),
    ] {
        failed(&quantize(options)?, status, &[words])?;
    }
    ensure!(!out.exists(), "a file was written");
    let mut sweep = research(&["sweep"]);
    sweep.arg(&policy).args(["--methods", "rtn", "--actquant", "head=4"]);
    failed(&run(sweep, b"")?, 1, &["no effect on rtn"])
}

#[test]
fn the_same_input_gives_the_same_bytes() -> Result<()> {
    let fixture = Fixture::new()?;
    for options in ["--bits 2", "--bits 3 --method rtn --group 32", "--bpw 4.5 --activations 16"] {
        let first = fs::read(fixture.image(options)?)?;
        // Another folder, and the old image in the way.
        let copy = Fixture::new()?;
        fs::write(copy.out(&format!("{options}.actq")), "ACTQ old")?;
        ensure!(first == fs::read(copy.image(options)?)?, "{options}: two runs differ");
    }
    Ok(())
}

#[test]
fn a_recording_may_have_any_name_and_format() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let image = fs::read(fixture.image("--bits 3 --group 32")?)?;
    // Another name and another format, the same frames: the same image.
    let obs = draw_observations(5, OBS);
    let named = fixture.out("mine.safetensors");
    let bytes: Vec<u8> = obs.iter().flat_map(|v| f64::from(*v).to_le_bytes()).collect();
    let length: Vec<u8> = [STEPS as i32, 7, STEPS as i32].iter().flat_map(|n| n.to_le_bytes()).collect();
    let (obs, lengths) = (vec![EPISODES, STEPS, OBS], vec![EPISODES]);
    fs::write(&named, safetensors([("obs", Dtype::F64, obs, bytes), ("length", Dtype::I32, lengths, length)]))?;
    fs::remove_file(policy.join("calib.npz"))?;
    let options = format!("--bits 3 --group 32 --calib {}", text(&named));
    let out = fixture.out("named.actq");
    succeeded(&fixture.quantize(&out, &options)?)?;
    assert_eq!(fs::read(&out)?, image);
    // With a recording anywhere, the default is the method that learns.
    failed(&fixture.quantize_as_given(&out, &options)?, 1, &["mine.safetensors", "frames", "200"])?;
    let missing = fixture.quantize(&out, "--calib none.npz")?;
    failed(&missing, 1, &["none.npz: cannot read the file"])
}

#[test]
fn quantize_reports_both_errors_and_faults_of_recordings() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let out = fixture.out("image.actq");
    let quantize = || fixture.quantize(&out, "--bits 8");
    // Every held-out value is within the calibrated range; without a terminal there are no progress bar and no escape
    // sequences.
    let wide = 1.3 * draw_observations(5, OBS);
    write_recording(&policy.join("calib.npz"), &wide, None, [STEPS as i64; EPISODES])?;
    let output = quantize()?;
    assert_eq!(notes(&output)?, Vec::<String>::new());
    let report = succeeded(&output)?;
    ensure!(
        report.contains(" ms at 168 MHz on a Cortex-M4"),
        "without --ms the time is at the default clock: {report}"
    );
    let number = |name: &str| -> Result<f64> {
        let line =
            report.lines().find_map(|line| line.strip_prefix(name)).with_context(|| format!("{name}: {report}"))?;
        Ok(line.split_whitespace().next().context("no number")?.trim_end_matches('%').parse()?)
    };
    let nmse = fixture.eval(&out)?["nmse"].as_f64().context("nmse")?;
    ensure!((number("error on frames it did not learn from")? / nmse - 1.0).abs() < 1e-3, "{nmse} in {report}");
    ensure!(number("error on frames it learned from")? > 0.0);
    // At 8 bits most of the error comes from the activations.
    ensure!((20.0..=100.0).contains(&number("activations")?) && report.contains("of the error (int8)"), "{report}");
    let people = succeeded(&run(actq(&["eval", &text(&out), "--policy", &text(&policy)]), b"")?)?;
    ensure!(people.contains("activations") && people.contains("of the error (int8)"), "{people}");

    // Two dimensions are constant in the recording, and one of them moves in the other.
    let mut obs = draw_observations(5, OBS);
    for row in obs.rows_mut() {
        let mut row = row;
        (row[4], row[5]) = (0.5, 0.25);
    }
    write_npy(&policy.join("calib.npy"), &obs)?;
    fs::remove_file(policy.join("calib.npz"))?;
    let mut moving = draw_observations(6, OBS);
    moving.rows_mut().into_iter().for_each(|mut row| row[4] = 0.5);
    write_recording(&policy.join("heldout.npz"), &moving, None, [STEPS as i64, 7, STEPS as i64])?;
    let warnings = notes(&quantize()?)?;
    ensure!(warnings.len() == 2, "{warnings:?}");
    ensure!(warnings[0].starts_with("note: observation dimensions 4-5 never change in calib.npy, "), "{warnings:?}");
    let outside = "note: 100.0% of the observations in heldout.npz leave the range of calib.npy by more than 10% of it, in \
                   dimensions 5 (100.0%)";
    ensure!(warnings[1].starts_with(outside), "{warnings:?}");
    let eval = run(actq(&["eval", &text(&out), "--policy", &text(&policy), "--json"]), b"")?;
    assert_eq!(notes(&eval)?, warnings[1..]);
    // A malformed recording for comparison does not stop eval.
    cut(&policy.join("calib.npy"), 100)?;
    let eval = notes(&run(actq(&["eval", &text(&out), "--policy", &text(&policy), "--json"]), b"")?)?;
    ensure!(eval.len() == 1 && eval[0].starts_with("note: cannot check the range of the observations: "), "{eval:?}");
    Ok(())
}

#[test]
fn parts_are_held_out_without_a_recording_for_it() -> Result<()> {
    let fixture = Fixture::new()?;
    let heldout = fixture.policy().join("heldout.npz");
    let named = fixture.out("named.npz");
    fs::rename(&heldout, &named)?;
    let quantize = |options: &str| -> Result<String> {
        succeeded(&fixture.quantize(&fixture.out("image.actq"), &format!("--bits 8 {options}"))?)
    };
    let of_parts = quantize("")?;
    let image = fs::read(fixture.out("image.actq"))?;
    let said = "(47 observations, 5 parts of the calibration recording in turn)";
    ensure!(of_parts.contains(said) && of_parts.contains("error on frames it learned from"), "{of_parts}");
    let of_recording = quantize(&format!("--heldout {}", text(&named)))?;
    ensure!(
        of_recording.contains("error on frames it did not learn from") && !of_recording.contains(said),
        "{of_recording}"
    );
    ensure!(fs::read(fixture.out("image.actq"))? == image, "the measurement changes the image");
    let rounded = quantize("--method rtn")?;
    ensure!(rounded.contains("(47 observations)") && !rounded.contains("did not learn from"), "{rounded}");
    Ok(())
}

#[test]
fn the_report_counts_the_weights_and_the_whole_file() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.out("image.actq");
    let report = succeeded(&fixture.quantize(&out, "--bits 8")?)?;
    let bytes = fs::metadata(&out)?.len() as usize;
    let number_before = |what: &str| -> Result<usize> {
        let (before, _) = report.split_once(what).with_context(|| format!("{what}: {report}"))?;
        Ok(before.rsplit(|c: char| !c.is_ascii_digit()).next().context("no number")?.parse()?)
    };
    let parts = [" bytes of weights", " bytes of biases", " of self-test", " of header and tables"];
    let sum: usize = parts.into_iter().map(number_before).sum::<Result<usize>>()?;
    assert_eq!(sum, bytes, "{report}");
    let weights: usize = HIDDEN * (OBS + HIDDEN + CHUNK * ACT);
    let bits = 8.0 * bytes as f64 / weights as f64;
    ensure!(report.contains(&format!("{bytes} bytes, {bits:.3} bits per weight")), "{bits} {report}");
    Ok(())
}

#[test]
fn overfitting_the_calibration_is_warned_of() -> Result<()> {
    let fixture = Fixture::new()?;
    // The held-out motions are small; an error that was small for large motions is large for them.
    let obs = 0.05 * draw_observations(6, OBS);
    write_recording(&fixture.policy().join("heldout.npz"), &obs, None, [STEPS as i64; EPISODES])?;
    let warnings = notes(&fixture.quantize(&fixture.out("image.actq"), "--bits 2")?)?;
    ensure!(warnings.len() == 2 && warnings[0].contains("times that on the calibration recording"), "{warnings:?}");
    ensure!(warnings[1].contains("do not drive a robot with this image"), "{warnings:?}");
    Ok(())
}
