//! What a new image does on the recordings: its errors where it was fitted and where it was not.

use actq_kernels::Image;
use anyhow::Result;

use super::eval::{self, ActivationShare, ErrorReport};
use crate::data::Dataset;

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
    /// On the held-out recording.
    pub heldout: Checked,
    /// On the calibration recording, where there is one.
    pub calib: Option<Checked>,
    /// What rounding the activations adds, on the held-out recording.
    pub activations: ActivationShare,
}

/// Runs `image`, made from `source`, over both recordings. Where one holds no actions, the f32 policy gives them.
pub fn check(source: &Policy, image: Image<'_>, calib: Option<&Dataset>, heldout: &Dataset) -> Result<Check> {
    let thinned = |dataset: &Dataset, most: usize| -> Dataset {
        let macs = source.graph.weights().max(1) * source.graph.denoising_steps();
        let mut dataset = dataset.thinned((most / macs).max(LEAST_FRAMES), source.graph.state_len() > 0).into_owned();
        dataset.fill_actions(&source.graph);
        dataset
    };
    let checked = |dataset: &Dataset, whole: &Dataset| -> Result<Checked> {
        Ok(Checked { report: eval::evaluate(image, dataset)?, recorded: whole.frames() })
    };
    let calib = calib.map(|calib| checked(&thinned(calib, MOST_MACS), calib)).transpose()?;
    let compared = thinned(heldout, MOST_HELDOUT_MACS);
    let heldout = checked(&compared, heldout)?;
    let activations = eval::activation_share(image, &compared, heldout.report.nmse)?;
    Ok(Check { heldout, calib, activations })
}
