//! The error summary, notes and warnings.

use actq::around::Around;
use actq::budget::Budget;
use actq::data::{Dataset, Range, Recordings, runs};
use actq::measure::check::{Check, Checked};
use actq::measure::eval::{ActivationShare, ErrorReport};
use actq::methods::Options;
use actq::methods::distill::balance::MixedUnits;
use actq::pipeline::{QuantizedPolicy, Reason, Unused};
use actq::policy::Policy;
use actq::text::count;

/// Ratio of held-out to calibration error above which there is a warning, if [`OVERFIT_DIFFERENCE`] is exceeded, too.
const OVERFIT_RATIO: f64 = 3.0;
/// Difference of held-out and calibration error (NMSE) above which there is a warning, if [`OVERFIT_RATIO`] is
/// exceeded.
const OVERFIT_DIFFERENCE: f64 = 0.002;

/// Error (NMSE) above which there is a warning not to use the image.
const USELESS: f64 = 0.1;

/// Formats the share of the error that comes from rounding the activations, and the activations' types.
pub fn activation_share(of: &ActivationShare) -> String {
    let types = match of.int16.len() {
        0 => "int8".to_owned(),
        n if n == of.linear => "int16".to_owned(),
        _ => format!("int8; linear operations in int16: {}", runs(&of.int16)),
    };
    let percent = 100.0 * of.share;
    // Not "-0%".
    let percent = if percent.abs() < 0.5 { 0.0 } else { percent };
    format!("{percent:.0}% of the error ({types})")
}

/// Returns the error for a missing calibration recording, with the steps to record one.
pub fn how_to_record(policy: &Policy) -> String {
    let n = policy.graph.obs_len;
    format!(
        "no calibration recording; pass one by --calib FILE, or put calib.npz beside the file. Quantization learns from the \
         observations of the policy's task, which an ONNX file does not hold. Run the policy in its simulator for a few thousand \
         steps, keep each observation as the file takes it ({n} values), and save them in order: numpy.save(\"obs.npy\", \
         numpy.reshape(observations, (-1, {n})).astype(\"float32\")). --method rtn needs no recording, but its errors are larger"
    )
}

/// Returns a note that lists the actions without limits, for which a motor controller refuses to arm.
pub fn without_limits(limits: impl IntoIterator<Item = Option<[f32; 2]>>) -> Option<String> {
    let is_limited =
        |limits: Option<[f32; 2]>| limits.is_some_and(|limits| limits.iter().all(|limit| limit.is_finite()));
    let limits = limits.into_iter().enumerate();
    let without: Vec<usize> = limits.filter(|(_, limits)| !is_limited(*limits)).map(|(i, _)| i).collect();
    (!without.is_empty()).then(|| {
        format!(
            "no finite limits for {} {}: a motor controller refuses to arm without limits; set low and high of action in \
             policy.json, or build the firmware by cargo xtask firmware --limits LOW:HIGH",
            if without.len() == 1 { "action" } else { "actions" },
            runs(&without)
        )
    })
}

/// Returns a note if a target of a description has no limits.
pub fn targets_without_limits(around: &Around) -> Option<String> {
    let is_limited =
        |i: usize| around.limits.as_ref().is_some_and(|[low, high]| low[i] > f32::MIN && high[i] < f32::MAX);
    let without: Vec<usize> = (0..around.action_len()).filter(|i| !is_limited(*i)).collect();
    (!without.is_empty()).then(|| {
        format!(
            "no finite limits for targets {}: a motor controller refuses to arm without limits; add limits = [LOW, HIGH] to [[target]] \
             in deploy.toml, or build the firmware by cargo xtask firmware --limits LOW:HIGH",
            runs(&without)
        )
    })
}

/// Formats the errors, a line for each.
pub fn errors(check: &Check) -> String {
    let of = |name: &str, checked: &Checked| line(name, &checked.report, checked.recorded);
    let calib = check.calib.as_ref().map_or(String::new(), |checked| of("calibration nmse", checked));
    let heldout = check.heldout.as_ref().map_or(String::new(), |checked| of("held-out nmse", checked));
    format!("{calib}{heldout}{:<17} {}\n", "activations", activation_share(&check.activations))
}

/// Formats the error on the image's own path.
pub fn own_path(report: &ErrorReport) -> String {
    line("own-path nmse", report, report.steps)
}

fn line(name: &str, report: &ErrorReport, recorded: usize) -> String {
    let of = if recorded > report.steps { format!("{} of ", report.steps) } else { String::new() };
    format!("{name:<17} {:.3e}   ({of}{})\n", report.nmse, count(recorded, "observation"))
}

/// Returns a warning if the held-out error is far above the calibration error.
pub fn overfit_warning(check: &Check) -> Option<String> {
    let (heldout, calib) = (check.heldout.as_ref()?.report.nmse, check.calib.as_ref()?.report.nmse);
    (heldout > OVERFIT_RATIO * calib && heldout > calib + OVERFIT_DIFFERENCE).then(|| {
        format!(
            "the held-out error is {:.1} times the calibration error: the image fits the calibration recording better than \
             new observations; record more episodes, and more varied ones",
            heldout / calib
        )
    })
}

/// Returns a warning if the image's actions are far from the policy's. An error of 1 is that of a constant action.
pub fn error_warning(check: &Check) -> Option<String> {
    let useless = useless(check.nmse()?)?;
    Some(format!("{useless}; allow more bits (--bpw, --flash), record more steps for --calib, or try --activations 16"))
}

/// Returns a warning if actions with this error are far from the policy's.
pub fn useless(nmse: f64) -> Option<String> {
    // A NaN counts as an error above the limit.
    (nmse.is_nan() || nmse > USELESS).then(|| {
        format!(
            "the error is {nmse:.2} (0: the policy's actions, 1: no better than their mean): do not drive a robot with this image"
        )
    })
}

/// Returns a note with the reason and the remedy if an image uses much less than its budget of bits or bytes.
pub fn unused_budget(found: &QuantizedPolicy, options: &Options) -> Option<String> {
    let Unused { used, allowed, reason } = Unused::of(found, options)?;
    let unit = if matches!(options.budget, Budget::ImageBytes(_)) { "bytes" } else { "bits per weight" };
    let why = match reason {
        Reason::Widest => "every row has the most bits that a row can have; a smaller budget gives the same image",
        Reason::NoError => {
            "more bits do not reduce the error, as the other rows do not affect the recorded actions; pass a smaller budget, or \
             record more varied episodes"
        }
        Reason::Step => "the next step of bits takes more than the rest of the budget; pass a larger budget for it",
    };
    let rounded = |value: f64| (1000.0 * value).round() / 1000.0;
    Some(format!("the image uses {} of {} {unit}: {why}", rounded(used), rounded(allowed)))
}

/// Returns all warnings about the recordings, before quantization.
pub fn of_recordings(recordings: &Recordings) -> Vec<String> {
    let Some(range) = recordings.calib.as_ref().map(Range::of) else { return Vec::new() };
    let outside = recordings.heldout.as_ref().and_then(|heldout| range.warning(heldout));
    let single = recordings.calib.as_ref().and_then(single_steps);
    [single, range.constant_note(), outside].into_iter().flatten().collect()
}

/// Returns a warning for each matrix that reads observations of very different units without balance.
pub fn mixed_units(mixed: &[MixedUnits]) -> Vec<String> {
    let text = |MixedUnits { matrix, observations: [coarsest, finest], bits }: &MixedUnits| {
        format!(
            "{matrix}: observations have very different units (the coarsest is {coarsest}'s, the finest {finest}'s), which costs \
             about {bits:.0} bits of each weight. Method distill cannot rescale the matrix's columns: another operation reads the \
             same values or weights, or the factors take more bytes than they save. Scale the observations by an op normalize in \
             policy.json, and the columns to match"
        )
    };
    mixed.iter().map(text).collect()
}

/// Returns a note if every episode has one step, as in an array of frames with a batch axis.
pub fn single_steps(recording: &Dataset) -> Option<String> {
    let episodes = recording.length.len();
    (episodes > 1 && recording.length.iter().all(|steps| *steps <= 1)).then(|| {
        format!(
            "{} holds {episodes} episodes of one step each; if they are one episode, save it as [frame, value], without a batch axis",
            recording.name()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(nmse: f64) -> ErrorReport {
        ErrorReport { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 7, bpw: 3.0, bytes: 100, worst_dimension: 0 }
    }

    fn check(calib: Option<f64>, heldout: f64) -> Check {
        let activations = ActivationShare { share: 0.125, int16: vec![0, 4], linear: 5 };
        let checked = |nmse: f64, recorded: usize| Checked { report: report(nmse), recorded };
        Check { heldout: Some(checked(heldout, 7)), calib: calib.map(|nmse| checked(nmse, 30)), activations }
    }

    #[test]
    fn held_out_far_above_calibration_error_warns() {
        let warning = overfit_warning(&check(Some(0.002), 0.0084)).expect("a warning");
        assert!(warning.starts_with("the held-out error is 4.2 times the calibration error: "), "{warning}");
        // Less than three times; less than 0.002 above; no calibration recording.
        for (calib, heldout) in [(Some(0.01), 0.029), (Some(1e-5), 0.002), (None, 0.5)] {
            assert_eq!(overfit_warning(&check(calib, heldout)), None, "{calib:?} {heldout}");
        }
    }

    #[test]
    fn error_above_a_tenth_warns() {
        let calib_only = |nmse| Check { heldout: None, ..check(Some(nmse), 0.0) };
        for of in [check(Some(0.001), 0.11), check(None, 1.0), check(None, f64::NAN), calib_only(0.2)] {
            assert!(error_warning(&of).is_some_and(|text| text.contains("--bpw")), "{of:?}");
        }
        for of in [check(Some(0.5), 0.09), check(None, 0.0), calib_only(0.1)] {
            assert_eq!(error_warning(&of), None, "{of:?}");
        }
        assert!(errors(&calib_only(0.2)).starts_with("calibration nmse  2.000e-1"));
    }

    #[test]
    fn actions_without_limits_are_listed() {
        let limited = Some([-1.0, 1.0]);
        let note = without_limits([None, limited, None, None]).expect("a note");
        assert!(note.starts_with("no finite limits for actions 0, 2-3: ") && note.contains("--limits"), "{note}");
        assert_eq!(without_limits([limited, limited]), None);
    }

    #[test]
    fn mixed_units_note_names_matrix_and_remedy() {
        let mixed = MixedUnits { matrix: "leg.weight".into(), observations: [3, 9], bits: 5.2 };
        let [text] = &mixed_units(&[mixed])[..] else { panic!("one note") };
        assert!(
            text.starts_with("leg.weight: ") && text.contains("3's, the finest 9's), which costs about 5 bits"),
            "{text}"
        );
        assert!(text.contains("op normalize in policy.json"), "{text}");
    }

    #[test]
    fn the_summary_has_a_line_for_each_error() {
        assert_eq!(
            errors(&check(Some(0.002), 0.0084)),
            "calibration nmse  2.000e-3   (7 of 30 observations)\n\
             held-out nmse     8.400e-3   (7 observations)\n\
             activations       12% of the error (int8; linear operations in int16: 0, 4)\n"
        );
        let mut one = check(None, 0.5);
        one.activations = ActivationShare { int16: Vec::new(), share: -0.01, ..one.activations };
        assert_eq!(
            errors(&one),
            "held-out nmse     5.000e-1   (7 observations)\nactivations       -1% of the error (int8)\n"
        );
        one.activations.int16 = vec![0, 1, 2, 3, 4];
        assert_eq!(activation_share(&one.activations), "-1% of the error (int16)");
    }
}
