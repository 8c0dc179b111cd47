//! What a new image does on the recordings: its errors where it was fitted and where it was not, and warnings.

use actq_kernels::Image;
use anyhow::Result;

use crate::dataset::Dataset;
use crate::dataset::range::Range;
use crate::eval::{self, ActivationShare, Report};
use crate::policy::Policy;

/// Multiplications that one run over a recording may take, about half a second of the executor on a host; a longer recording
/// is thinned.
const MOST_MACS: usize = 600_000_000;
/// Held-out errors beyond this multiple of the calibration error, and this much above it, are worth a warning.
const TIMES: f64 = 3.0;
const ABOVE: f64 = 0.002;

/// Errors of an image on its policy's recordings.
#[derive(Clone, Debug)]
pub struct Check {
    /// On the held-out recording.
    pub heldout: Report,
    /// On the calibration recording, where there is one.
    pub calib: Option<Report>,
    /// What rounding the activations adds, on the held-out recording.
    pub activations: ActivationShare,
}

/// Runs `image`, made from `source`, over both recordings. Where one holds no actions, the f32 policy gives them.
pub fn check(source: &Policy, image: Image<'_>, calib: Option<&Dataset>, heldout: &Dataset) -> Result<Check> {
    let with_actions = |dataset: &Dataset| -> Dataset {
        let most = MOST_MACS / source.graph.weights().max(1);
        let mut dataset = dataset.thinned(most.max(1), source.graph.state_len() > 0).into_owned();
        dataset.fill_actions(&source.graph);
        dataset
    };
    let calib = calib.map(|calib| eval::evaluate(image, &with_actions(calib))).transpose()?;
    let heldout = with_actions(heldout);
    let report = eval::evaluate(image, &heldout)?;
    let activations = eval::activation_share(image, &heldout, report.nmse)?;
    Ok(Check { heldout: report, calib, activations })
}

impl Check {
    /// The errors in a few lines.
    pub fn summary(&self) -> String {
        let line =
            |name: &str, report: &Report| format!("{name:<17} {:.3e}   ({} observations)\n", report.nmse, report.steps);
        let calib = self.calib.as_ref().map_or(String::new(), |report| line("calibration nmse", report));
        format!("{calib}{}{:<17} {}\n", line("held-out nmse", &self.heldout), "activations", self.activations)
    }

    /// A warning where the held-out error is far above the calibration error.
    pub fn overfit_warning(&self) -> Option<String> {
        let (heldout, calib) = (self.heldout.nmse, self.calib.as_ref()?.nmse);
        (heldout > TIMES * calib && heldout > calib + ABOVE).then(|| {
            format!(
                "the held-out error is {:.1} times the calibration error: the image fits what was recorded for it better \
                 than what it will see; record more episodes, and more varied ones",
                heldout / calib
            )
        })
    }
}

/// All warnings about the recordings themselves, before anything is quantized.
pub fn recording_notes(calib: Option<&Dataset>, heldout: Option<&Dataset>) -> Vec<String> {
    let Some(range) = calib.map(Range::of) else { return Vec::new() };
    let outside = heldout.and_then(|heldout| range.warning(heldout));
    [range.constant_note(), outside].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(nmse: f64) -> Report {
        Report { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 7, bpw: 3.0, bytes: 100, worst_dimension: 0 }
    }

    fn errors(calib: Option<f64>, heldout: f64) -> Check {
        let activations = ActivationShare { unrounded_nmse: 0.0, share: 0.125, int16: vec![0, 4], linear: 5 };
        Check { heldout: report(heldout), calib: calib.map(report), activations }
    }

    #[test]
    fn a_held_out_error_far_above_the_calibration_error_is_worth_a_warning() {
        let warning = errors(Some(0.002), 0.0084).overfit_warning().expect("a warning");
        assert!(warning.starts_with("the held-out error is 4.2 times the calibration error: "), "{warning}");
        // Less than three times; less than 0.002 above; no calibration recording.
        for (calib, heldout) in [(Some(0.01), 0.029), (Some(1e-5), 0.002), (None, 0.5)] {
            assert_eq!(errors(calib, heldout).overfit_warning(), None, "{calib:?} {heldout}");
        }
    }

    #[test]
    fn the_summary_has_a_line_for_each_error() {
        assert_eq!(
            errors(Some(0.002), 0.0084).summary(),
            "calibration nmse  2.000e-3   (7 observations)\n\
             held-out nmse     8.400e-3   (7 observations)\n\
             activations       12% of the error (int8; linear operations in int16: 0, 4)\n"
        );
        let mut one = errors(None, 0.5);
        one.activations = ActivationShare { int16: Vec::new(), share: -0.01, ..one.activations };
        assert_eq!(
            one.summary(),
            "held-out nmse     5.000e-1   (7 observations)\nactivations       -1% of the error (int8)\n"
        );
        one.activations.int16 = vec![0, 1, 2, 3, 4];
        assert_eq!(one.activations.to_string(), "-1% of the error (int16)");
    }
}
