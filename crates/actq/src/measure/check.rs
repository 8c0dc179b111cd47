//! Errors of a new image on its calibration and held-out recordings.

use actq_kernels::Image;

use super::eval::{self, ActivationShare, ErrorReport};
use crate::data::{Dataset, Recordings, heavy_note, outside_note};
use crate::error::Result;
use crate::graph::Graph;
use crate::methods::Method;
use crate::pipeline::HeldOut;
use crate::policy::Policy;

/// Most MACs of a run over the calibration recording, about half a second of the executor on a host; a longer recording
/// is thinned.
const MAX_MACS: u64 = 600_000_000;

/// Most MACs of a run over the held-out recording: all but the longest recordings then give the same error as `actq
/// eval`.
const MAX_HELDOUT_MACS: u64 = 20_000_000_000;

/// Frames that are always kept: an iterative head runs its network many times for each.
const MIN_FRAMES: usize = 200;

/// Errors of an image on a recording, or on a thinned one if it is long.
#[derive(Clone, Debug)]
pub struct Checked {
    /// Errors on the compared frames.
    pub report: ErrorReport,
    /// Frames of the whole recording.
    pub recorded: usize,
}

/// Errors of an image on its policy's recordings.
#[derive(Clone, Debug)]
pub struct Check {
    /// Errors on the held-out recording, if there is one; else on held-out parts of the calibration recording.
    pub heldout: Option<Checked>,
    /// Number of these parts, 0 with a held-out recording.
    pub parts: usize,
    /// `true` if the image has learned from the calibration recording.
    pub learned: bool,
    /// Errors on the calibration recording, if there is one.
    pub calib: Option<Checked>,
    /// Error added by rounding the activations, on the held-out recording or else on the calibration recording.
    pub activations: ActivationShare,
    /// Note on a frame that has most of the variance of a recording's actions.
    pub heavy: Option<String>,
    /// `true` if there is such a frame, or one with a value far outside of all others.
    pub outliers: bool,
}

/// Largest part of an image's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Frames unlike all others, from which the image learned little else.
    Outliers,
    /// The rounding of the activations.
    Activations,
    /// A recording that is too short, or too uniform: the error on frames that were not learned from is higher.
    Recording,
    /// The rounding and removal of weights.
    Weights,
}

impl Check {
    /// Returns the cause of at least half of the error; outliers, whatever their part, hide any other.
    pub fn cause(&self) -> Cause {
        let [heldout, calib] = [&self.heldout, &self.calib].map(|checked| checked.as_ref().map(|of| of.report.nmse));
        match (heldout, calib) {
            _ if self.outliers => Cause::Outliers,
            _ if self.activations.share >= 0.5 => Cause::Activations,
            (Some(heldout), Some(calib)) if self.learned && heldout >= 2.0 * calib => Cause::Recording,
            _ => Cause::Weights,
        }
    }

    /// Returns the frames of a recording whose held-out parts have at most 1.2 times the error that the two errors
    /// approach, the mean of both; `None` if this one has. The difference of the errors falls with the frames.
    pub fn frames_to_record(&self) -> Option<usize> {
        let (heldout, calib) = (self.heldout.as_ref()?, self.calib.as_ref()?);
        let frames = calib.recorded as f64;
        let (held_out, learned) = (heldout.report.nmse, calib.report.nmse);
        let wanted = 5.0 * frames * (held_out - learned) / (held_out + learned);
        (self.learned && wanted > frames).then(|| two_digits(wanted))
    }

    /// Returns the error on the held-out recording, or else on the calibration recording.
    pub fn nmse(&self) -> Option<f64> {
        self.heldout.as_ref().or(self.calib.as_ref()).map(|checked| checked.report.nmse)
    }
}

/// Rounds up to two digits.
fn two_digits(number: f64) -> usize {
    let unit = libm::pow(10.0, (libm::log10(number.max(10.0)).floor() - 1.0).max(0.0));
    ((number / unit).ceil() * unit) as usize
}

/// Returns the frames of a recording that are learned from or held out that are compared, with actions: all, or evenly
/// spaced ones of a long recording.
pub(crate) fn compared(graph: &Graph, dataset: &Dataset) -> Dataset {
    thinned(graph, dataset, MAX_MACS)
}

fn thinned(graph: &Graph, dataset: &Dataset, most: u64) -> Dataset {
    let macs = graph.weights().max(1) as u64 * graph.denoising_steps() as u64;
    let frames = usize::try_from(most / macs).unwrap_or(usize::MAX);
    let mut dataset = dataset.thinned(frames.max(MIN_FRAMES), graph.state_len() > 0).into_owned();
    dataset.fill_actions(graph);
    dataset
}

/// Runs `image`, made from `source` by `method`, over the recordings; `None` without any. If one holds no actions, the
/// f32 policy gives them. `held_out` is the error on parts of the calibration recording, without a held-out one.
pub fn check(
    source: &Policy,
    image: Image<'_>,
    recordings: &Recordings,
    method: &Method,
    held_out: Option<HeldOut>,
) -> Result<Option<Check>> {
    let checked = |whole: Option<&Dataset>, most: u64| -> Result<Option<(Dataset, Checked)>> {
        let Some(whole) = whole else { return Ok(None) };
        let compared = thinned(&source.graph, whole, most);
        let report = eval::evaluate(image, &compared)?;
        Ok(Some((compared, Checked { report, recorded: whole.frames() })))
    };
    let calib = checked(recordings.calib.as_ref(), MAX_MACS)?;
    let heldout = checked(recordings.heldout.as_ref(), MAX_HELDOUT_MACS)?;
    let Some((compared, of)) = heldout.as_ref().or(calib.as_ref()) else { return Ok(None) };
    let activations = eval::activation_share(image, compared, of.report.nmse)?;
    let pairs = [(&heldout, &recordings.heldout), (&calib, &recordings.calib)];
    let heavy = pairs.into_iter().find_map(|(compared, whole)| heavy_note(&compared.as_ref()?.0, whole.as_ref()?));
    let recorded = [&recordings.calib, &recordings.heldout];
    let outliers = heavy.is_some() || recorded.into_iter().flatten().any(|dataset| outside_note(dataset).is_some());
    let [heldout, calib] = [heldout, calib].map(|checked| checked.map(|(_, checked)| checked));
    let parts = held_out.as_ref().map_or(0, |held_out| held_out.parts);
    let of_parts = held_out.map(|HeldOut { report, .. }| Checked { recorded: report.steps, report });
    let (heldout, learned) = (heldout.or(of_parts), *method != Method::Rtn);
    Ok(Some(Check { heldout, parts, learned, calib, activations, heavy, outliers }))
}
