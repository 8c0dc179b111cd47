//! The error summary, notes and warnings.

use actq::around::Around;
use actq::budget::Budget;
use actq::data::{Dataset, Range, Recordings, axes_note, outside_note, runs};
use actq::measure::check::{Cause, Check, Checked};
use actq::measure::eval::{ActivationShare, ErrorReport};
use actq::methods::distill::balance::MixedUnits;
use actq::methods::{Effort, Method, Options};
use actq::pipeline::{QuantizedPolicy, Reason, Unused};
use actq::policy::Policy;
use actq::text::count;
use actq_kernels::Width;

/// Ratio of held-out to calibration error above which there is a warning, if [`OVERFIT_DIFFERENCE`] is exceeded, too.
const OVERFIT_RATIO: f64 = 3.0;
/// Difference of held-out and calibration error (NMSE) above which there is a warning, if [`OVERFIT_RATIO`] is
/// exceeded.
const OVERFIT_DIFFERENCE: f64 = 0.002;

/// Frames of a recording of which some can be held out, in quarters of the fewest to learn from.
const HELD_OUT_FROM: usize = 5;

/// Error (NMSE) above which an image is not to be used.
pub(crate) const USELESS: f64 = 0.1;

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

/// Returns notes on a policy: actions or targets without limits, a rate that its source does not state, values without
/// effect, the source's treatment of values that are not finite, and actions of its source that it does not have.
pub fn of_policy(policy: &Policy) -> Vec<String> {
    let limits = match &policy.around {
        Some(around) => of_targets(around),
        None => without_limits((0..policy.act_len).map(|i| policy.contract.limits(i))),
    };
    limits
        .into_iter()
        .chain(default_rate(policy))
        .chain(without_effect(policy))
        .chain(guards(&policy.guards))
        .chain(policy.refused.iter().cloned())
        .collect()
}

/// Returns a note on what a policy's source does with values that are not finite.
pub(crate) fn guards<'a>(guards: impl IntoIterator<Item = &'a String>) -> Option<String> {
    let all: Vec<&str> = guards.into_iter().map(String::as_str).collect();
    (!all.is_empty()).then(|| {
        format!(
            "{}. The image has none of these: a step with NaN or infinity in its observation is refused, and the application must \
             replace such values before the step",
            all.join("; ")
        )
    })
}

/// Returns notes that list the values of the network's observation that no action depends on, and its actions that no
/// observation changes.
pub(crate) fn without_effect(policy: &Policy) -> Vec<String> {
    let [observations, actions] = actq::graph::without_effect(&policy.graph);
    let list = |of: &str, indices: &[usize], text: &str| {
        let s = if indices.len() == 1 { "" } else { "s" };
        (!indices.is_empty()).then(|| format!("{text} {of}{s} {}", runs(indices)))
    };
    let unread = list("value", &observations, "no action of the network depends on the observation's");
    let fixed = list("action", &actions, "no observation changes the network's");
    unread.into_iter().chain(fixed).collect()
}

/// Returns a note if a policy has the default rate because its source states none.
pub(crate) fn default_rate(policy: &Policy) -> Option<String> {
    (!policy.has_rate).then(|| {
        format!(
            "the policy states no control rate, and the image has {} Hz, the default: pass --rate-hz HZ to actq import, or set \
             control_hz in policy.json",
            policy.rate_hz
        )
    })
}

/// Returns a note that lists the actions without limits, for which a motor controller refuses to arm.
pub(crate) fn without_limits(limits: impl IntoIterator<Item = Option<[f32; 2]>>) -> Option<String> {
    let without = unlimited(limits);
    (!without.is_empty()).then(|| {
        format!(
            "no finite limits for {} {}: a motor controller refuses to arm without limits; pass --limits LOW:HIGH to actq import, \
             set low and high of action in policy.json, or build the firmware by cargo xtask firmware --limits LOW:HIGH",
            if without.len() == 1 { "action" } else { "actions" },
            runs(&without)
        )
    })
}

/// Returns the indices of values without finite limits.
fn unlimited(limits: impl IntoIterator<Item = Option<[f32; 2]>>) -> Vec<usize> {
    let is_limited =
        |limits: Option<[f32; 2]>| limits.is_some_and(|limits| limits.iter().all(|limit| limit.is_finite()));
    let limits = limits.into_iter().enumerate();
    limits.filter(|(_, limits)| !is_limited(*limits)).map(|(i, _)| i).collect()
}

/// Returns a note if a target of a description has no limits.
fn of_targets(around: &Around) -> Option<String> {
    let is_limit = |limit: f32| limit > f32::MIN && limit < f32::MAX;
    targets_without_limits((0..around.action_len()).map(|i| {
        let [low, high] = around.limits.as_ref()?;
        Some([low[i], high[i]]).filter(|limits| limits.iter().all(|limit| is_limit(*limit)))
    }))
}

/// Returns a note that lists the targets without limits.
pub(crate) fn targets_without_limits(limits: impl IntoIterator<Item = Option<[f32; 2]>>) -> Option<String> {
    let without = unlimited(limits);
    (!without.is_empty()).then(|| {
        format!(
            "no finite limits for targets {}: a motor controller refuses to arm without limits; pass --limits LOW:HIGH to actq import, add \
             limits = [LOW, HIGH] to [[target]] in deploy.toml, or build the firmware by cargo xtask firmware --limits LOW:HIGH",
            runs(&without)
        )
    })
}

/// Formats the errors, a line for each.
pub fn errors(check: &Check) -> String {
    let calib = if check.learned { LEARNED } else { "error on the calibration frames" };
    let parts = match check.parts {
        0 => String::new(),
        1 => ", a part of the calibration recording".to_owned(),
        parts => format!(", {parts} parts of the calibration recording in turn"),
    };
    let of = |name: &str, checked: &Checked, which: &str| line(name, &checked.report, checked.recorded, which);
    let calib = check.calib.as_ref().map_or(String::new(), |checked| of(calib, checked, ""));
    let heldout = check.heldout.as_ref().map_or(String::new(), |checked| of(OTHERS, checked, &parts));
    format!("{calib}{heldout}{}", named("activations", &activation_share(&check.activations)))
}

/// Names of the two errors.
const LEARNED: &str = "error on frames it learned from";
const OTHERS: &str = "error on frames it did not learn from";

/// Formats the error on the image's own path.
pub fn own_path(report: &ErrorReport) -> String {
    line("error on its own path", report, report.steps, "")
}

fn line(name: &str, report: &ErrorReport, recorded: usize, which: &str) -> String {
    let of = if recorded > report.steps { format!("{} of ", report.steps) } else { String::new() };
    named(name, &format!("{:.3e} of the variance   ({of}{}{which})", report.nmse, count(recorded, "observation")))
}

fn named(name: &str, text: &str) -> String {
    format!("{name:<width$}  {text}\n", width = OTHERS.len())
}

/// Returns all notes on the errors of an image made with `options`.
pub fn of_check(check: &Check, options: &Options) -> Vec<String> {
    [check.heavy.clone(), not_held_out(check, options), overfit_warning(check), error_warning(check, options)]
        .into_iter()
        .flatten()
        .collect()
}

/// Returns a note if no frames could be held out to measure the error.
fn not_held_out(check: &Check, options: &Options) -> Option<String> {
    let calib = check.calib.as_ref().filter(|_| check.learned && check.heldout.is_none())?;
    let enough = HELD_OUT_FROM * options.method.least_frames() / 4;
    let why = match calib.recorded < enough {
        true => format!("{} are too few to hold some out; record {enough} or more", count(calib.recorded, "frame")),
        false => "no part of them could be held out within the budget; pass another recording by --heldout".to_owned(),
    };
    Some(format!(
        "the error is that of the frames that the image learned from, and on others it may be much larger: {why}"
    ))
}

/// Returns a warning if the error on other frames is far above that on those that the image learned from.
pub fn overfit_warning(check: &Check) -> Option<String> {
    let (heldout, calib) = (check.heldout.as_ref()?.report.nmse, check.calib.as_ref()?.report.nmse);
    (!check.outliers && heldout > OVERFIT_RATIO * calib && heldout > calib + OVERFIT_DIFFERENCE).then(|| {
        let frames = check.frames_to_record().map_or(String::new(), |frames| format!(", about {frames} steps in all"));
        format!(
            "the {OTHERS} is {:.1} times that on the calibration recording, which it fits better than \
             new observations; record more episodes, and more varied ones{frames}",
            heldout / calib
        )
    })
}

/// Returns a warning if the image's actions are far from the policy's. An error of 1 is that of a constant action.
pub fn error_warning(check: &Check, options: &Options) -> Option<String> {
    let useless = useless(check.nmse()?)?;
    let remedy = match check.cause() {
        Cause::Outliers => "frames unlike all others may cause it: leave them out, as the notes say".to_owned(),
        Cause::Activations => "most of it comes from rounding the activations: pass --activations 16".to_owned(),
        Cause::Recording => {
            let frames = check.frames_to_record().map_or(String::new(), |frames| format!(", about {frames} in all"));
            format!("most of it comes from the short recording: record more steps for --calib{frames}")
        }
        Cause::Weights => {
            let short = options.steps.is_some() || options.effort == Effort::Quick;
            let learn = match options.method {
                Method::Distill if short => ", or learn longer (--steps, --effort)",
                Method::Distill => "",
                _ => ", or let them learn (--method distill)",
            };
            format!("it comes from the weights: allow more bits (--bpw, --flash){learn}")
        }
    };
    Some(format!("{useless}; {remedy}"))
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

/// Returns a note if one width is asked for of a method that divides bits better.
pub fn one_width(options: &Options) -> Option<String> {
    let Budget::Width(width) = options.budget else { return None };
    let is_divided = options.method == Method::Distill && options.forced.is_empty() && width != Width::W8;
    is_divided.then(|| {
        let bits = width.bits();
        format!("method distill gives each row its own bits by --bpw {bits}: fewer bytes than --bits {bits}, and mostly a smaller error")
    })
}

/// Returns all warnings about the recordings, before quantization.
pub fn of_recordings(recordings: &Recordings) -> Vec<String> {
    let Some(range) = recordings.calib.as_ref().map(Range::of) else { return Vec::new() };
    let outside = recordings.heldout.as_ref().and_then(|heldout| range.warning(heldout));
    let axes = recordings.calib.as_ref().and_then(of_axes);
    let far = [&recordings.calib, &recordings.heldout].map(|recording| recording.as_ref().and_then(outside_note));
    [axes, range.constant_note(), outside].into_iter().chain(far).flatten().collect()
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

/// Returns a note if the axes of a recording may be others than episodes and steps.
pub(crate) fn of_axes(recording: &Dataset) -> Option<String> {
    single_steps(recording).or_else(|| axes_note(recording))
}

/// Returns a note if every episode has one step, as in an array of frames with a batch axis.
fn single_steps(recording: &Dataset) -> Option<String> {
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
        let calib = calib.map(|nmse| checked(nmse, 30));
        Check {
            heldout: Some(checked(heldout, 7)),
            parts: 0,
            learned: true,
            calib,
            activations,
            heavy: None,
            outliers: false,
        }
    }

    fn options() -> Options {
        Options::new(Method::Distill, Budget::BitsPerWeight(2.0))
    }

    #[test]
    fn held_out_far_above_calibration_error_warns() {
        let warning = overfit_warning(&check(Some(0.002), 0.0084)).expect("a warning");
        assert!(
            warning.starts_with("the error on frames it did not learn from is 4.2 times that on the calibration"),
            "{warning}"
        );
        // Less than three times; less than 0.002 above; no calibration recording.
        assert_eq!(overfit_warning(&Check { outliers: true, ..check(Some(0.002), 0.0084) }), None);
        for (calib, heldout) in [(Some(0.01), 0.029), (Some(1e-5), 0.002), (None, 0.5)] {
            assert_eq!(overfit_warning(&check(calib, heldout)), None, "{calib:?} {heldout}");
        }
    }

    #[test]
    fn error_above_a_tenth_warns() {
        let calib_only = |nmse| Check { heldout: None, ..check(Some(nmse), 0.0) };
        for of in [check(Some(0.001), 0.11), check(None, 1.0), check(None, f64::NAN), calib_only(0.2)] {
            assert!(error_warning(&of, &options()).is_some(), "{of:?}");
        }
        for of in [check(Some(0.5), 0.09), check(None, 0.0), calib_only(0.1)] {
            assert_eq!(error_warning(&of, &options()), None, "{of:?}");
        }
        assert!(
            errors(&calib_only(0.2))
                .starts_with("error on frames it learned from        2.000e-1 of the variance   (7 of 30 obs")
        );
    }

    #[test]
    fn advice_follows_the_measured_cause() {
        let advice = |of: &Check, options: &Options| error_warning(of, options).expect("a warning");
        let rounded = ActivationShare { share: 0.6, int16: Vec::new(), linear: 5 };
        let activations = advice(&Check { activations: rounded, ..check(Some(0.3), 0.3) }, &options());
        assert!(activations.ends_with("rounding the activations: pass --activations 16"), "{activations}");
        let outliers = advice(&Check { outliers: true, ..check(Some(0.1), 0.3) }, &options());
        assert!(outliers.contains("leave them out") && !outliers.contains("record more"), "{outliers}");
        let recording = advice(&check(Some(0.1), 0.3), &options());
        assert!(recording.ends_with("record more steps for --calib, about 75 in all"), "{recording}");
        let weights = check(Some(0.25), 0.3);
        assert!(advice(&weights, &options()).ends_with("allow more bits (--bpw, --flash)"));
        let quick = Options { effort: Effort::Quick, ..options() };
        assert!(advice(&weights, &quick).ends_with("or learn longer (--steps, --effort)"));
        let rounding = Options::new(Method::Rtn, Budget::BitsPerWeight(2.0));
        assert!(advice(&Check { learned: false, ..check(Some(0.1), 0.3) }, &rounding).ends_with("(--method distill)"));
    }

    #[test]
    fn one_width_of_distill_names_the_better_budget() {
        let of = |method, budget| one_width(&Options::new(method, budget));
        let note = of(Method::Distill, Budget::Width(Width::W3)).expect("a note");
        assert!(note.contains("by --bpw 3: fewer bytes than --bits 3"), "{note}");
        for (method, budget) in [
            (Method::Distill, Budget::BitsPerWeight(3.0)),
            (Method::Distill, Budget::Width(Width::W8)),
            (Method::Gptq, Budget::Width(Width::W3)),
        ] {
            assert_eq!(of(method, budget), None);
        }
    }

    #[test]
    fn an_error_of_learned_frames_is_said() {
        let short = Check { heldout: None, ..check(Some(0.01), 0.0) };
        let [note] = &of_check(&short, &options())[..] else { panic!("one note") };
        assert!(
            note.contains("30 frames are too few to hold some out") && note.ends_with("record 250 or more"),
            "{note}"
        );
        assert!(of_check(&Check { learned: false, ..short }, &options()).is_empty());
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
            "error on frames it learned from        2.000e-3 of the variance   (7 of 30 observations)\n\
             error on frames it did not learn from  8.400e-3 of the variance   (7 observations)\n\
             activations                            12% of the error (int8; linear operations in int16: 0, 4)\n"
        );
        let mut one = check(None, 0.5);
        one.activations = ActivationShare { int16: Vec::new(), share: -0.01, ..one.activations };
        assert_eq!(
            errors(&one),
            "error on frames it did not learn from  5.000e-1 of the variance   (7 observations)\n\
             activations                            -1% of the error (int8)\n"
        );
        one.parts = 5;
        assert!(errors(&one).contains("(7 observations, 5 parts of the calibration recording in turn)"));
        let rounded = Check { learned: false, ..check(Some(0.002), 0.0084) };
        assert!(errors(&rounded).starts_with("error on the calibration frames        2.000e-3"));
        one.activations.int16 = vec![0, 1, 2, 3, 4];
        assert_eq!(activation_share(&one.activations), "-1% of the error (int16)");
    }
}
