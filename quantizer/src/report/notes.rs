//! Errors in a few lines, and what is worth a warning.

use actq::budget::Budget;
use actq::data::{Dataset, Range, Recordings, runs};
use actq::measure::check::{Check, Checked};
use actq::measure::eval::{ActivationShare, ErrorReport};
use actq::methods::Options;
use actq::methods::distill::balance::MixedUnits;
use actq::pipeline::{QuantizedPolicy, Reason, Unused};
use actq::policy::Policy;

/// Held-out errors beyond this multiple of the calibration error, and this much above it, are worth a warning.
const TIMES: f64 = 3.0;
const ABOVE: f64 = 0.002;

/// Beyond this error the actions have little to do with the policy's.
const USELESS: f64 = 0.1;

/// The share of the error that is due to rounded activations, and their types.
pub fn activation_share(of: &ActivationShare) -> String {
    let types = match of.int16.len() {
        0 => "int8".to_owned(),
        n if n == of.linear => "int16".to_owned(),
        _ => format!("int8; linear operations in int16: {}", runs(&of.int16)),
    };
    format!("{:.0}% of the error ({types})", 100.0 * of.share)
}

/// Where a method needs a recording and there is none: how to make one, and why.
pub fn how_to_record(policy: &Policy) -> String {
    let n = policy.graph.obs_len;
    format!(
        "no recording is given (--calib FILE, or calib.npz beside the file). Which weights may be rounded coarsely follows from the \
         observations that the policy really sees, and no ONNX file holds them. Run the policy in its simulator for a few thousand \
         steps, keep each observation as the file takes it ({n} values), and save them in order: numpy.save(\"obs.npy\", \
         numpy.reshape(observations, (-1, {n})).astype(\"float32\")). --method rtn works without, with larger errors"
    )
}

/// A note on the actions without limits, which a motor controller cannot let move.
pub fn without_limits(limits: impl IntoIterator<Item = Option<[f32; 2]>>) -> Option<String> {
    let limits = limits.into_iter().enumerate();
    let without: Vec<usize> = limits.filter(|(_, limits)| limits.is_none()).map(|(i, _)| i).collect();
    (!without.is_empty()).then(|| {
        format!(
            "no finite limits for actions {}: a motor controller refuses to arm without; set low and high of action in policy.json, \
             or build the firmware with cargo xtask firmware --limits LOW:HIGH",
            runs(&without)
        )
    })
}

/// The errors in a few lines.
pub fn errors(check: &Check) -> String {
    let of = |name: &str, checked: &Checked| line(name, &checked.report, checked.recorded);
    let calib = check.calib.as_ref().map_or(String::new(), |checked| of("calibration nmse", checked));
    let heldout = check.heldout.as_ref().map_or(String::new(), |checked| of("held-out nmse", checked));
    format!("{calib}{heldout}{:<17} {}\n", "activations", activation_share(&check.activations))
}

/// The error where the image itself has led.
pub fn own_path(report: &ErrorReport) -> String {
    line("own-path nmse", report, report.steps)
}

fn line(name: &str, report: &ErrorReport, recorded: usize) -> String {
    let of = if recorded > report.steps { format!(" of {recorded}") } else { String::new() };
    format!("{name:<17} {:.3e}   ({}{of} observations)\n", report.nmse, report.steps)
}

/// A warning where the held-out error is far above the calibration error.
pub fn overfit_warning(check: &Check) -> Option<String> {
    let (heldout, calib) = (check.heldout.as_ref()?.report.nmse, check.calib.as_ref()?.report.nmse);
    (heldout > TIMES * calib && heldout > calib + ABOVE).then(|| {
        format!(
            "the held-out error is {:.1} times the calibration error: the image fits what was recorded for it better \
             than what it will see; record more episodes, and more varied ones",
            heldout / calib
        )
    })
}

/// A warning where the image's actions are far from the policy's, whose error of 1 is that of a constant action.
pub fn error_warning(check: &Check) -> Option<String> {
    let nmse = check.nmse()?;
    // An error that is not a number is not below the limit either.
    (nmse.is_nan() || nmse > USELESS).then(|| {
        format!(
            "the error is {nmse:.2} (0: the policy's actions, 1: no better than their mean): do not drive a robot with this image; allow \
             more bits (--bpw, --flash), record more steps for --calib, or try --activations int16"
        )
    })
}

/// A note where an image uses much less than its budget of bits or bytes: why, and what to do.
pub fn unused_budget(found: &QuantizedPolicy, options: &Options) -> Option<String> {
    let Unused { used, allowed, reason } = Unused::of(found, options)?;
    let unit = if matches!(options.budget, Budget::ImageBytes(_)) { "bytes" } else { "bits per weight" };
    let why = match reason {
        Reason::Widest => "every row has the most bits that it may have; a smaller budget gives the same image",
        Reason::NoError => {
            "more bits do not reduce the error, as the other rows have no part in the recorded actions; pass a smaller budget, \
             or record more varied episodes"
        }
        Reason::Step => "the next rows with more bits take more than is left; pass a larger budget to get them",
    };
    let rounded = |value: f64| (1000.0 * value).round() / 1000.0;
    Some(format!("the image uses {} of {} {unit}: {why}", rounded(used), rounded(allowed)))
}

/// All warnings about the recordings themselves, before anything is quantized.
pub fn of_recordings(recordings: &Recordings) -> Vec<String> {
    let Some(range) = recordings.calib.as_ref().map(Range::of) else { return Vec::new() };
    let outside = recordings.heldout.as_ref().and_then(|heldout| range.warning(heldout));
    let single = recordings.calib.as_ref().and_then(single_steps);
    [single, range.constant_note(), outside].into_iter().flatten().collect()
}

/// A warning for each matrix that reads observations in units far apart, which are not balanced.
pub fn mixed_units(mixed: &[MixedUnits]) -> Vec<String> {
    let text = |MixedUnits { matrix, observations: [coarsest, finest], bits }: &MixedUnits| {
        format!(
            "{matrix}: observations come in units far apart (the coarsest is {coarsest}'s, the finest {finest}'s), which takes about \
             {bits:.0} bits from each weight, and distill cannot rescale the matrix's columns: another operation reads the same values or \
             weights, or the factors take more bytes than they save; scale the observations by an op normalize in policy.json, and \
             the columns to match"
        )
    };
    mixed.iter().map(text).collect()
}

/// A note where every episode has a single step, as frames with a batch's axis look.
pub fn single_steps(recording: &Dataset) -> Option<String> {
    let episodes = recording.length.len();
    (episodes > 1 && recording.length.iter().all(|steps| *steps <= 1)).then(|| {
        format!(
            "{} holds {episodes} episodes of one step each; if they are one run, save it as [frame, value], without the axis of a batch",
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
        let activations = ActivationShare { unrounded_nmse: 0.0, share: 0.125, int16: vec![0, 4], linear: 5 };
        let checked = |nmse: f64, recorded: usize| Checked { report: report(nmse), recorded };
        Check { heldout: Some(checked(heldout, 7)), calib: calib.map(|nmse| checked(nmse, 30)), activations }
    }

    #[test]
    fn a_held_out_error_far_above_the_calibration_error_is_worth_a_warning() {
        let warning = overfit_warning(&check(Some(0.002), 0.0084)).expect("a warning");
        assert!(warning.starts_with("the held-out error is 4.2 times the calibration error: "), "{warning}");
        // Less than three times; less than 0.002 above; no calibration recording.
        for (calib, heldout) in [(Some(0.01), 0.029), (Some(1e-5), 0.002), (None, 0.5)] {
            assert_eq!(overfit_warning(&check(calib, heldout)), None, "{calib:?} {heldout}");
        }
    }

    #[test]
    fn an_error_above_a_tenth_is_worth_a_warning() {
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
    fn actions_without_limits_are_worth_a_note() {
        let limited = Some([-1.0, 1.0]);
        let note = without_limits([None, limited, None, None]).expect("a note");
        assert!(note.starts_with("no finite limits for actions 0, 2-3: ") && note.contains("--limits"), "{note}");
        assert_eq!(without_limits([limited, limited]), None);
    }

    #[test]
    fn a_matrix_with_units_far_apart_is_named_with_the_remedy() {
        let mixed = MixedUnits { matrix: "leg.weight".into(), observations: [3, 9], bits: 5.2 };
        let [text] = &mixed_units(&[mixed])[..] else { panic!("one note") };
        assert!(
            text.starts_with("leg.weight: ") && text.contains("3's, the finest 9's), which takes about 5 bits"),
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
