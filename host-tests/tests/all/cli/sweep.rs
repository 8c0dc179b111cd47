//! `actq sweep`, and the recordings that it accepts.

use std::fs;

use actq_bench::command::{actq, failed, research, run, succeeded};
use anyhow::{Result, ensure};

use super::fixture::{Fixture, OBS, draw_observations, text, write_npy};

#[test]
fn sweep_accepts_named_recordings() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let (calib, heldout) = (fixture.out("c.npz"), fixture.out("h.npz"));
    fs::rename(policy.join("calib.npz"), &calib)?;
    fs::rename(policy.join("heldout.npz"), &heldout)?;
    let sweep = |more: &[&str]| {
        let policy = text(&policy);
        run(actq(&[&["sweep", &policy, "--methods", "rtn,gptq", "--bpw", "4"], more].concat()), b"")
    };
    let table = succeeded(&sweep(&["--heldout", &text(&heldout), "--calib", &text(&calib)])?)?;
    ensure!(table.contains("4 bits") && table.contains("gptq") && table.contains("at 168 MHz"), "{table}");
    Ok(())
}

/// After an error of the sweep itself no job starts, and it ends after the workers that run.
#[test]
#[cfg(target_os = "linux")]
fn no_worker_outlives_a_sweep_without_log() -> Result<()> {
    let fixture = Fixture::new()?;
    let (policy, store) = (text(&fixture.policy()), fixture.out("store"));
    let line = "--methods rtn --bpw 2,3,4 --threads 2 --log /dev/full --store";
    let arguments: Vec<&str> = ["sweep", &policy].into_iter().chain(line.split_whitespace()).collect();
    let output = run(actq(&[&arguments[..], &[&text(&store)]].concat()), b"")?;
    failed(&output, 1, &["/dev/full: cannot write the file"])?;
    let names = fs::read_dir(&store)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    let names = names.collect::<Result<Vec<_>>>()?;
    let results = names.iter().filter(|name| name.ends_with(".json") && *name != "store.json").count();
    ensure!(results == 2, "two workers started: {names:?}");
    Ok(())
}

/// Every method that needs actions takes the f32 policy's, and so do the errors.
#[test]
fn sweep_accepts_recordings_without_actions() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let [calib, heldout] =
        [("calib", 3), ("heldout", 4)].map(|(name, seed)| (fixture.out(&format!("{name}.npy")), seed));
    for (file, seed) in [&calib, &heldout] {
        write_npy(file, &draw_observations(*seed, OBS))?;
    }
    for recording in ["calib.npz", "heldout.npz"] {
        fs::remove_file(policy.join(recording))?;
    }
    let arguments = ["sweep", &text(&policy), "--methods", "rtn,actquant", "--bpw", "4"];
    let recordings = ["--calib", &text(&calib.0), "--heldout", &text(&heldout.0)];
    let table = succeeded(&run(research(&[&arguments[..], &recordings].concat()), b"")?)?;
    ensure!(table.contains("actquant"), "{table}");
    Ok(())
}
