//! How far an image's actions are from the f32 policy's.

use std::path::Path;

use actq_kernels::Image;
use anyhow::{Context, Result, ensure};
use serde::Serialize;

use crate::dataset::Dataset;
use crate::inspect;
use crate::runtime::with_head;

/// Errors of the raw network output against recorded f32 actions.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Mean over the output's dimensions of (mean squared error / variance of the recorded values).
    pub nmse: f64,
    /// The largest of these ratios.
    pub worst_nmse: f64,
    /// The largest absolute error, in units of the raw output.
    pub max_abs: f64,
    /// Observations compared.
    pub steps: usize,
    /// Bits per weight, everything counted.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Output dimension of `worst_nmse`.
    #[serde(skip)]
    pub worst_dimension: usize,
}

/// Runs `image` over the valid steps of `dataset`, from a reset at the start of each episode, and compares its raw output with
/// the recorded actions. Dimensions that never vary in the record are left out of the ratios.
pub fn evaluate(image: Image<'_>, dataset: &Dataset) -> Result<Report> {
    let out_len = image.output().len;
    let mut error = vec![Moment::default(); out_len];
    let mut signal = vec![Moment::default(); out_len];
    let mut max_abs = 0f64;
    with_head(image, |head| {
        for episode in 0..dataset.length.len() {
            head.reset();
            for (step, obs) in dataset.episode(episode).enumerate() {
                let at = || format!("{}: episode {episode}, step {step}", dataset.path.display());
                let out = head.infer(&obs).with_context(at)?;
                let recorded = dataset.action_at(episode, step).context("array \"action\" is missing")?;
                for (i, (&y, &r)) in out.iter().zip(&recorded).enumerate() {
                    let difference = f64::from(y) - f64::from(r);
                    error[i].add(difference);
                    signal[i].add(f64::from(r));
                    max_abs = max_abs.max(difference.abs());
                }
            }
        }
        Ok(())
    })?;
    let ratios: Vec<(usize, f64)> = (0..out_len)
        .filter(|&i| signal[i].variance() > 0.0)
        .map(|i| (i, error[i].mean_square() / signal[i].variance()))
        .collect();
    ensure!(!ratios.is_empty(), "{}: the recorded actions never vary", dataset.path.display());
    let (worst_dimension, worst_nmse) = ratios.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
    Ok(Report {
        nmse: ratios.iter().map(|r| r.1).sum::<f64>() / ratios.len() as f64,
        worst_nmse,
        max_abs,
        steps: dataset.frames(),
        bpw: inspect::bits_per_weight(&image),
        bytes: image.bytes(),
        worst_dimension,
    })
}

/// The held-out recording of a policy folder, which must belong to `image`.
pub fn heldout(policy_dir: &Path, image: &Image<'_>) -> Result<Dataset> {
    let dataset = Dataset::load(&policy_dir.join("heldout.npz"), image.obs_len(), image.output().len)?;
    ensure!(dataset.action.is_some(), "{}: array \"action\" is missing", dataset.path.display());
    Ok(dataset)
}

#[derive(Clone, Default)]
struct Moment {
    n: f64,
    sum: f64,
    square: f64,
}

impl Moment {
    fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.square += x * x;
    }

    fn mean_square(&self) -> f64 {
        self.square / self.n
    }

    fn variance(&self) -> f64 {
        // A constant sequence leaves rounding noise of either sign.
        let variance = self.mean_square() - (self.sum / self.n).powi(2);
        if variance > 1e-12 * self.mean_square() { variance } else { 0.0 }
    }
}
