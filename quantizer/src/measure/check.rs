//! What a new image does on the recordings: its errors where it was fitted and where it was not.

use actq_kernels::Image;
use anyhow::Result;

use super::eval::{self, ActivationShare, ErrorReport};
use crate::data::Dataset;

use crate::policy::Policy;

/// Multiplications that one run over a recording may take, about half a second of the executor on a host; a longer
/// recording is thinned.
const MOST_MACS: usize = 600_000_000;

/// Frames that are kept in any case: an iterative head runs its network many times for each.
const LEAST_FRAMES: usize = 200;

/// Errors of an image on its policy's recordings.
#[derive(Clone, Debug)]
pub struct Check {
    /// On the held-out recording.
    pub heldout: ErrorReport,
    /// On the calibration recording, where there is one.
    pub calib: Option<ErrorReport>,
    /// What rounding the activations adds, on the held-out recording.
    pub activations: ActivationShare,
}

/// Runs `image`, made from `source`, over both recordings. Where one holds no actions, the f32 policy gives them.
pub fn check(source: &Policy, image: Image<'_>, calib: Option<&Dataset>, heldout: &Dataset) -> Result<Check> {
    let with_actions = |dataset: &Dataset| -> Dataset {
        let macs = source.graph.weights().max(1) * source.graph.denoising_steps();
        let mut dataset =
            dataset.thinned((MOST_MACS / macs).max(LEAST_FRAMES), source.graph.state_len() > 0).into_owned();
        dataset.fill_actions(&source.graph);
        dataset
    };
    let calib = calib.map(|calib| eval::evaluate(image, &with_actions(calib))).transpose()?;
    let heldout = with_actions(heldout);
    let report = eval::evaluate(image, &heldout)?;
    let activations = eval::activation_share(image, &heldout, report.nmse)?;
    Ok(Check { heldout: report, calib, activations })
}
