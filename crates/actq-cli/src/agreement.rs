//! Decides by a run in float64 which float32 run of an ONNX file is right: the policy's or onnxruntime's.

use anyhow::{Result, bail};

/// Largest error of a correct run, as a share of the largest action.
const TOLERANCE: f64 = 1e-5;

/// Returns the largest difference of `run` from `right`, as a share of the largest value of `right`; infinite if a
/// value is not finite.
pub(crate) fn error(right: &[f64], run: &[f64]) -> f64 {
    if !right.iter().chain(run).all(|v| v.is_finite()) {
        return f64::INFINITY;
    }
    let scale = right.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
    right.iter().zip(run).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) / scale
}

/// Errors of the two float32 runs against the file in float64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InFloat64 {
    /// Error of the policy.
    pub(crate) policy: f64,
    /// Error of onnxruntime.
    pub(crate) onnxruntime: f64,
}

/// Returns the reference that the policy agrees with, and its error, as text. Fails if the policy is wrong, or if no
/// run proves it right. `difference` is the error between the two float32 runs; `in_float64` is called only if they
/// differ.
pub(crate) fn verdict(difference: f64, in_float64: impl FnOnce() -> Result<InFloat64>) -> Result<String> {
    if difference <= TOLERANCE {
        return Ok(format!("against onnxruntime: {} at most", error_text(difference)));
    }
    let InFloat64 { policy, onnxruntime } = match in_float64() {
        Ok(errors) => errors,
        Err(reason) => bail!(
            "the policy and onnxruntime disagree ({}), and the run in float64 failed, which would show which is right: {reason:#}",
            error_text(difference)
        ),
    };
    let errors = format!(
        "against the file in float64 the policy's actions are {}, onnxruntime's are {}",
        error_text(policy),
        error_text(onnxruntime)
    );
    match (policy <= TOLERANCE, onnxruntime <= TOLERANCE) {
        (true, _) => Ok(format!(
            "against the file in float64: {} at most; onnxruntime's are {}, by its float32 arithmetic",
            error_text(policy),
            error_text(onnxruntime)
        )),
        (false, true) => bail!("{errors}; internal error; please report it"),
        (false, false) => bail!(
            "{errors}: no two of the three runs agree, so the check cannot show which is right; pass recorded observations \
             with --calib if the drawn ones are outside the policy's range"
        ),
    }
}

/// Returns the same for a file that onnxruntime cannot run for this `reason`. `policy` is the policy's error against the
/// run in float64.
pub(crate) fn float64_verdict(reason: &str, policy: Result<f64>) -> Result<String> {
    match policy {
        Ok(policy) if policy <= TOLERANCE => {
            Ok(format!("against the file in float64: {} at most; {reason}", error_text(policy)))
        }
        Ok(policy) => bail!(
            "against the file in float64 the policy's actions are {}, and {reason}, which could show which is right",
            error_text(policy)
        ),
        Err(second) => bail!("{reason}; {second:#}"),
    }
}

fn error_text(error: f64) -> String {
    if error.is_finite() { format!("off by {error:.1e} of the largest action") } else { "not finite".to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict_text(difference: f64, in_float64: Result<[f64; 2], &str>) -> Result<String, String> {
        let errors = in_float64.map(|[policy, onnxruntime]| InFloat64 { policy, onnxruntime });
        verdict(difference, || errors.map_err(|reason| anyhow::anyhow!("{reason}"))).map_err(|error| error.to_string())
    }

    #[test]
    fn agreeing_runs_need_no_float64() {
        let said = verdict(9e-6, || unreachable!()).expect("they agree");
        assert_eq!(said, "against onnxruntime: off by 9.0e-6 of the largest action at most");
    }

    #[test]
    fn float64_says_which_run_is_right() {
        let policy = verdict_text(4.6e-3, Ok([2e-7, 4.6e-3])).expect("the policy is right");
        assert!(policy.starts_with("against the file in float64: off by 2.0e-7 of"), "{policy}");
        assert!(policy.contains("onnxruntime's are off by 4.6e-3 of the largest action, by its float32"), "{policy}");
        let infinite = verdict_text(f64::INFINITY, Ok([2e-7, f64::INFINITY])).expect("the policy is right");
        assert!(infinite.contains("onnxruntime's are not finite"), "{infinite}");
        let ours = verdict_text(3e-2, Ok([3e-2, 1e-7])).expect_err("onnxruntime is right");
        assert!(
            ours.contains("actions are off by 3.0e-2 of the largest action, onnxruntime's are off by 1.0e-7"),
            "{ours}"
        );
        assert!(ours.ends_with("internal error; please report it"), "{ours}");
    }

    #[test]
    fn disagreement_of_all_runs_blames_none() {
        for undecided in [verdict_text(3e-2, Ok([2e-2, 1e-2])), verdict_text(3e-2, Err("No module named 'onnx'"))] {
            let said = undecided.expect_err("undecided");
            assert!(
                said.contains("no two of the three runs agree") || said.ends_with("right: No module named 'onnx'"),
                "{said}"
            );
            assert!(!said.contains("internal error"), "{said}");
        }
    }

    #[test]
    fn float64_decides_without_onnxruntime() {
        let text =
            |policy| float64_verdict("onnxruntime cannot run this file: no Elu", policy).map_err(|e| e.to_string());
        let agrees = text(Ok(2e-7)).expect("the policy is right");
        assert!(agrees.contains("2.0e-7") && agrees.ends_with("cannot run this file: no Elu"), "{agrees}");
        assert!(text(Ok(1e-3)).is_err_and(|said| said.contains("off by 1.0e-3")));
        assert!(text(Err(anyhow::anyhow!("no onnx"))).is_err_and(|said| said.ends_with("no Elu; no onnx")));
    }

    #[test]
    fn error_is_a_share_of_the_largest_value() {
        assert_eq!(error(&[-4.0, 1.0], &[-4.0, 1.5]), 0.125);
        assert_eq!(error(&[0.0, 1.0], &[f64::NAN, 1.0]), f64::INFINITY);
        assert_eq!(error(&[f64::INFINITY], &[f64::INFINITY]), f64::INFINITY);
    }
}
