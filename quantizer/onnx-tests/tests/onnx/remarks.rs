//! Remarks on a file: guards against NaN and infinity, and operators that it must not have.

use actq_cli::report::imported::summary;
use actq_cli::report::notes;
use actq_onnx::Choice;
use anyhow::Result;

use super::file::File;
use super::imported;

/// Imports `actions := Identity(gemm(guarded, 2, 4))`, beside a critic with a guard of its own.
fn remarks(guarded: &str) -> Result<(Vec<String>, Vec<String>)> {
    let mut file = File::default();
    file.input("obs", &[1, 4]);
    file.write(
        &[],
        &format!(
            "{guarded}
             actions := Identity(gemm(x, 2, 4))
             value := Identity(gemm(Where(IsNaN(obs), 7.0, obs), 1, 4))"
        ),
    );
    file.output("actions", &[1, 2]);
    file.output("value", &[1, 1]);
    let (imported, policy) = imported(&file.bytes(), &Choice::default())?;
    let report = summary(&imported, &policy);
    let refusal =
        "a step with NaN or infinity in its observation is refused, and the application must replace such values";
    assert_eq!(report.contains(refusal), !imported.guards.is_empty());
    assert!(imported.guards.iter().all(|guard| report.matches(guard).count() == 1), "{report}");
    // `quantize` and Python take the file without this summary.
    let notes = notes::of_policy(&policy).join("\n");
    assert!(imported.guards.iter().all(|guard| notes.contains(guard)), "{notes}");
    Ok((imported.guards, imported.faults))
}

#[test]
fn guards_of_the_action_are_named_once() -> Result<()> {
    for (text, expected) in [
        ("x = Tanh(obs)", &[][..]),
        ("x = Clip(obs, -5.0, 5.0)", &[]),
        ("x = Where(IsNaN(obs), 0.0, obs)", &["node 0 \"/node/0\" (IsNaN) replaces NaN by 0"]),
        ("x = Where(Not(Equal(obs, obs)), -2.5, obs)", &["node 0 \"/node/0\" (Equal) replaces NaN by -2.5"]),
        (
            "finite = Not(Or(IsNaN(obs), IsInf(obs)))\nx = Where(finite, obs, 0.0)",
            &["node 0 \"/node/0\" (IsNaN) replaces NaN by 0", "node 1 \"/node/1\" (IsInf) replaces infinity by 0"],
        ),
        ("x = obs + Cast(IsNaN(obs), to=1)", &["node 0 \"/node/0\" (IsNaN) tests for NaN"]),
        ("x = Clip(obs, -3.4028235e38, 5.0)", &["node 0 \"/node/0\" (Clip) limits infinity to a finite number"]),
        (
            "x = Min(Max(obs, -3.4028235e38), 3.4028235e38)",
            &[
                "node 0 \"/node/0\" (Max) limits infinity to a finite number",
                "node 1 \"/node/1\" (Min) limits infinity to a finite number",
            ],
        ),
        (
            "x = Min(Max(obs, [-3.4028235e38, -1.0, -1.0, -1.0]), [3.4028235e38, 1.0, 1.0, 1.0])",
            &[
                "node 0 \"/node/0\" (Max) limits infinity to a finite number",
                "node 1 \"/node/1\" (Min) limits infinity to a finite number",
            ],
        ),
    ] {
        assert_eq!(remarks(text)?.0, expected, "{text}");
    }
    Ok(())
}

#[test]
fn operators_younger_than_the_file_are_faults() -> Result<()> {
    // The files of these tests declare operator set 17.
    assert_eq!(remarks("x = LayerNormalization(obs, full(1, 4))")?.1, [""; 0]);
    let fault = "node 0 \"/node/0\" (Swish): Swish is an operator from operator set 24 on, and the file declares 17";
    assert_eq!(remarks("x = Swish(obs)")?.1, [fault]);
    Ok(())
}
