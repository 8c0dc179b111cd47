//! `ur3-drive`, as `actq tune` runs it.
#![cfg(unix)]

use std::process::{Command, Output};

use serde_json::Value;

fn drive(policy: &str, round: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ur3-drive"));
    command.args(["--episodes", "1"]).env("POLICY_CMD", policy).env("ACTQ_ROUND", round);
    command.output().unwrap()
}

#[test]
fn the_drive_prints_one_json_object() {
    // 200 actions of zeros: the arm never moves.
    let output = drive("sh -c 'head -c 4800 /dev/zero; cat > /dev/null'", "1");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["episodes"], &report["success"]), (&1.into(), &0.0.into()));
    assert!(report["ci"][1].as_f64() > Some(0.5) && report["tracking_error_mm"].as_f64() > Some(10.0), "{report}");
}

#[test]
fn a_failing_policy_is_an_error() {
    for (policy, round, words) in [
        ("exit 1", "0", "policy"),
        ("sh -c 'head -c 4800 /dev/zero; cat > /dev/null; exit 3'", "0", "the policy failed: exit status: 3"),
        ("cat", "180", "kept for evaluation and training"),
    ] {
        let output = drive(policy, round);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && error.contains(words), "{policy}: {error}");
    }
}
