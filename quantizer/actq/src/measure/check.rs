//! Errors of a new image on its calibration and held-out recordings.

use actq_kernels::Image;

use super::eval::{self, ActivationShare, ErrorReport};
use crate::data::{Dataset, Recordings};
use crate::error::Result;
use crate::policy::Policy;

/// Most MACs of a run over the calibration recording, about half a second of the executor on a host; a longer recording
/// is thinned.
const MOST_MACS: usize = 600_000_000;

/// Most MACs of a run over the held-out recording: all but the longest recordings then give the same error as `actq
/// eval`.
const MOST_HELDOUT_MACS: usize = 20_000_000_000;

/// Frames that are always kept: an iterative head runs its network many times for each.
const LEAST_FRAMES: usize = 200;

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
    /// Errors on the held-out recording, if there is one.
    pub heldout: Option<Checked>,
    /// Errors on the calibration recording, if there is one.
    pub calib: Option<Checked>,
    /// Error added by rounding the activations, on the held-out recording or else on the calibration recording.
    pub activations: ActivationShare,
}

impl Check {
    /// Returns the error on the held-out recording, or else on the calibration recording.
    pub fn nmse(&self) -> Option<f64> {
        self.heldout.as_ref().or(self.calib.as_ref()).map(|checked| checked.report.nmse)
    }
}

/// Runs `image`, made from `source`, over the recordings; `None` without any. If one holds no actions, the f32 policy
/// gives them.
pub fn check(source: &Policy, image: Image<'_>, recordings: &Recordings) -> Result<Option<Check>> {
    let thinned = |dataset: &Dataset, most: usize| -> Dataset {
        let macs = source.graph.weights().max(1) * source.graph.denoising_steps();
        let mut dataset = dataset.thinned((most / macs).max(LEAST_FRAMES), source.graph.state_len() > 0).into_owned();
        dataset.fill_actions(&source.graph);
        dataset
    };
    let checked = |whole: Option<&Dataset>, most: usize| -> Result<Option<(Dataset, Checked)>> {
        let Some(whole) = whole else { return Ok(None) };
        let compared = thinned(whole, most);
        let report = eval::evaluate(image, &compared)?;
        Ok(Some((compared, Checked { report, recorded: whole.frames() })))
    };
    let calib = checked(recordings.calib.as_ref(), MOST_MACS)?;
    let heldout = checked(recordings.heldout.as_ref(), MOST_HELDOUT_MACS)?;
    let Some((compared, of)) = heldout.as_ref().or(calib.as_ref()) else { return Ok(None) };
    let activations = eval::activation_share(image, compared, of.report.nmse)?;
    let [heldout, calib] = [heldout, calib].map(|checked| checked.map(|(_, checked)| checked));
    Ok(Some(Check { heldout, calib, activations }))
}
