//! What a new image does on the recordings: its errors where it was fitted and where it was not.

use actq_kernels::Image;

use super::eval::{self, ActivationShare, ErrorReport};
use crate::data::{Dataset, Recordings};
use crate::error::Result;
use crate::policy::Policy;

/// Multiplications that a run over the calibration recording may take, about half a second of the executor on a host; a
/// longer recording is thinned.
const MOST_MACS: usize = 600_000_000;

/// As [`MOST_MACS`], of the held-out recording: so many that its error is what `actq eval` says, but for the longest.
const MOST_HELDOUT_MACS: usize = 20_000_000_000;

/// Frames that are kept in any case: an iterative head runs its network many times for each.
const LEAST_FRAMES: usize = 200;

/// Errors of an image on a recording, or on what is left of it where it is long.
#[derive(Clone, Debug)]
pub struct Checked {
    /// On what was compared.
    pub report: ErrorReport,
    /// Observations of the whole recording.
    pub recorded: usize,
}

/// Errors of an image on its policy's recordings.
#[derive(Clone, Debug)]
pub struct Check {
    /// On the held-out recording, where there is one.
    pub heldout: Option<Checked>,
    /// On the calibration recording, where there is one.
    pub calib: Option<Checked>,
    /// What rounding the activations adds, on the held-out recording, or else on the calibration recording.
    pub activations: ActivationShare,
}

impl Check {
    /// The error to go by: on the held-out recording, or else on the calibration recording.
    pub fn nmse(&self) -> Option<f64> {
        self.heldout.as_ref().or(self.calib.as_ref()).map(|checked| checked.report.nmse)
    }
}

/// Runs `image`, made from `source`, over what recordings there are; `None` where there are none. Where one holds no
/// actions, the f32 policy gives them.
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
