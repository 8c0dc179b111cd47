//! The results of a plan as one.

use actq::budget::Budget;
use actq::measure::eval::ErrorReport;
use actq::measure::interval::wilson;
use serde::{Deserialize, Serialize};

use crate::figures::{Driven, JobResult};
use crate::frontier::{Curve, frontier, knee};

/// The results of a plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Merged {
    /// Clock of all predicted times in Hz, of a Cortex-M4 with FPU and memory that never waits.
    pub clock_hz: f64,
    /// The policies, in the order of the spec.
    pub policies: Vec<MergedPolicy>,
}

/// The images of a policy.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MergedPolicy {
    /// The policy's name.
    pub policy: String,
    /// Its images, in the order of the plan.
    pub images: Vec<MergedImage>,
    /// Indices of the images that no other one beats in bytes and error, from the smallest image on.
    pub frontier: Vec<usize>,
    /// The same for bytes and the share of successful episodes; empty without.
    pub success_frontier: Vec<usize>,
    /// Index of the image after which a further byte gains least, of the curve that has the lowest error at most
    /// budgets.
    pub knee: Option<usize>,
}

/// One image.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MergedImage {
    /// The method's name.
    pub method: String,
    /// Budget of the image.
    pub budget: Budget,
    /// Seed.
    pub seed: u64,
    /// The on-policy round; 0 without.
    pub round: usize,
    /// Address of the job that made it.
    pub address: String,
    /// Its figures; `None` if no image is within the budget.
    pub made: Option<Figures>,
}

/// Figures of an image.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// The image.
    pub image: JobResult,
    /// Error on the held-out recording (NMSE).
    pub nmse: f64,
    /// Largest ratio of a dimension.
    pub worst_nmse: f64,
    /// Largest absolute error, in units of the raw output.
    pub max_abs: f64,
    /// Observations that the error was measured on.
    pub observations: usize,
    /// All closed-loop episodes together.
    pub driven: Option<Driven>,
    /// 95% interval of the share of successful episodes.
    pub interval: Option<[f64; 2]>,
}

impl Figures {
    /// Takes an image's errors and episodes.
    pub(crate) fn new(image: JobResult, report: ErrorReport, driven: Option<Driven>) -> Self {
        let counts = driven.as_ref().and_then(|driven| Some((driven.successes?, driven.episodes)));
        let interval = counts.map(|(successes, episodes)| wilson(successes as f64, episodes as f64));
        let ErrorReport { nmse, worst_nmse, max_abs, steps: observations, .. } = report;
        Self { image, nmse, worst_nmse, max_abs, observations, driven, interval }
    }

    /// Returns the predicted milliseconds of a step.
    pub fn milliseconds(&self, clock_hz: f64) -> f64 {
        1e3 * self.image.cycles as f64 / clock_hz
    }

    /// Returns the share of successful episodes.
    pub fn success(&self) -> Option<f64> {
        let driven = self.driven.as_ref()?;
        Some(driven.successes? as f64 / driven.episodes.max(1) as f64)
    }
}

impl MergedPolicy {
    /// Takes the images of a policy.
    pub(crate) fn new(policy: &str, images: Vec<MergedImage>) -> Self {
        let frontier = frontier_of(&images, |figures| Some(figures.nmse));
        let success_frontier = frontier_of(&images, |figures| figures.success().map(|share| -share));
        let mut merged = Self { policy: policy.to_owned(), images, frontier, success_frontier, knee: None };
        merged.knee = merged.find_knee();
        merged
    }

    /// Returns the images of each curve, by its name, in the order of the plan: one curve for each method, seed and
    /// on-policy round.
    pub fn curves(&self) -> Vec<(String, Vec<&MergedImage>)> {
        let named = self.named().into_iter();
        named.map(|(name, images)| (name, images.into_iter().map(|i| &self.images[i]).collect())).collect()
    }

    /// Returns the indices of the images of each curve.
    fn named(&self) -> Vec<(String, Vec<usize>)> {
        let mut curves: Vec<(String, Vec<usize>)> = Vec::new();
        for (i, image) in self.images.iter().enumerate() {
            let name = self.curve(image);
            match curves.iter_mut().find(|(known, _)| *known == name) {
                Some((_, images)) => images.push(i),
                None => curves.push((name, vec![i])),
            }
        }
        curves
    }

    /// Returns the name of an image's curve: its method, and the seed and round if they differ.
    pub fn curve(&self, image: &MergedImage) -> String {
        let mut name = image.method.clone();
        if self.images.iter().any(|other| other.seed != image.seed) {
            name += &format!(", seed {}", image.seed);
        }
        if image.round > 0 {
            name += &format!(", round {}", image.round);
        }
        name
    }

    fn find_knee(&self) -> Option<usize> {
        // Every curve has each budget once, in the same order.
        let curves = self.named();
        let point = |&i: &usize| self.images[i].made.as_ref().map(|made| (made.image.bytes as f64, made.nmse));
        let points: Vec<Curve> = curves.iter().map(|(_, images)| images.iter().map(point).collect()).collect();
        let (curve, budget) = knee(&points)?;
        Some(curves[curve].1[budget])
    }
}

/// Returns the images that no other one beats in bytes and `cost`.
fn frontier_of(images: &[MergedImage], cost: impl Fn(&Figures) -> Option<f64>) -> Vec<usize> {
    let point = |(i, image): (usize, &MergedImage)| {
        let figures = image.made.as_ref()?;
        Some((i, (figures.image.bytes as f64, cost(figures)?)))
    };
    let (of, points): (Vec<usize>, Vec<(f64, f64)>) = images.iter().enumerate().filter_map(point).unzip();
    frontier(&points).into_iter().map(|point| of[point]).collect()
}
