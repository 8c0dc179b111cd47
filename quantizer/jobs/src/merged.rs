//! The results of a plan as one.

use actq::measure::eval::ErrorReport;
use actq::measure::time::CLOCK;
use actq::pipeline::sweep::{Curve, Point, Sweep, knee};
use serde::{Deserialize, Serialize};

use crate::figures::{Driven, Made};

/// The results of a plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Merged {
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
}

/// One image.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MergedImage {
    /// The method's name.
    pub method: String,
    /// Allowed bits per weight.
    pub budget: f64,
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
    pub image: Made,
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
    pub(crate) fn new(image: Made, report: ErrorReport, driven: Option<Driven>) -> Self {
        let counts = driven.as_ref().and_then(|driven| Some((driven.successes?, driven.episodes)));
        let interval = counts.map(|(successes, episodes)| wilson(successes as f64, episodes as f64));
        let ErrorReport { nmse, worst_nmse, max_abs, steps: observations, .. } = report;
        Self { image, nmse, worst_nmse, max_abs, observations, driven, interval }
    }

    /// Returns the share of successful episodes.
    pub fn success(&self) -> Option<f64> {
        let driven = self.driven.as_ref()?;
        Some(driven.successes? as f64 / driven.episodes.max(1) as f64)
    }
}

/// Returns the 95% interval of a share (Wilson: Probable inference, the law of succession, and statistical inference,
/// 1927).
fn wilson(successes: f64, trials: f64) -> [f64; 2] {
    /// Quantile of the normal distribution.
    const Z: f64 = 1.96;
    let (share, z2) = (successes / trials, Z * Z / trials);
    let middle = share + z2 / 2.0;
    let reach = Z * (share * (1.0 - share) / trials + z2 / (4.0 * trials)).sqrt();
    [-reach, reach].map(|side| ((middle + side) / (1.0 + z2)).clamp(0.0, 1.0))
}

impl MergedPolicy {
    /// Begins without images.
    pub(crate) fn of(name: &str) -> Self {
        Self { policy: name.to_owned(), images: Vec::new(), frontier: Vec::new(), success_frontier: Vec::new() }
    }

    /// Finds both frontiers of the images.
    pub(crate) fn find_frontiers(&mut self) {
        self.frontier = self.frontier_of(|figures| Some(figures.nmse));
        self.success_frontier = self.frontier_of(|figures| figures.success().map(|share| -share));
    }

    /// Returns the images that no other one beats in bytes and `cost`. Of equal ones, the first counts.
    fn frontier_of(&self, cost: impl Fn(&Figures) -> Option<f64>) -> Vec<usize> {
        let of = |(i, image): (usize, &MergedImage)| {
            let figures = image.made.as_ref()?;
            Some((figures.image.bytes, cost(figures)?, i))
        };
        let mut points: Vec<(usize, f64, usize)> = self.images.iter().enumerate().filter_map(of).collect();
        points.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut least = f64::INFINITY;
        points.retain(|&(_, cost, _)| {
            let better = cost < least;
            least = least.min(cost);
            better
        });
        points.into_iter().map(|(_, _, i)| i).collect()
    }

    /// Returns the errors as a [`Sweep`], with one curve for each method, seed and on-policy round.
    pub fn sweep(&self) -> Sweep {
        let mut budgets: Vec<f64> = Vec::new();
        self.images.iter().map(|image| image.budget).for_each(|budget| {
            if !budgets.contains(&budget) {
                budgets.push(budget);
            }
        });
        let mut curves: Vec<Curve> = Vec::new();
        for image in &self.images {
            let method = self.curve(image);
            let i = curves.iter().position(|curve| curve.method == method).unwrap_or(curves.len());
            if i == curves.len() {
                curves.push(Curve { method, points: vec![None; budgets.len()], scores: Vec::new() });
            }
            let points = budgets.iter().zip(&mut curves[i].points);
            points.filter(|(budget, _)| **budget == image.budget).for_each(|(_, point)| *point = image.point());
            if let Some(made) = image.made.as_ref().filter(|_| curves[i].scores.is_empty()) {
                curves[i].scores.clone_from(&made.image.scores);
            }
        }
        let matrices = self.images.iter().find_map(|image| Some(image.made.as_ref()?.image.matrices.clone()));
        let knee = knee(&curves);
        let (policy, matrices) = (self.policy.clone(), matrices.unwrap_or_default());
        Sweep { policy, matrices, budgets, clock_hz: CLOCK, curves, knee }
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
}

impl MergedImage {
    fn point(&self) -> Option<Point> {
        let Figures { image, nmse, worst_nmse, max_abs, observations, .. } = self.made.as_ref()?;
        let report = ErrorReport {
            nmse: *nmse,
            worst_nmse: *worst_nmse,
            max_abs: *max_abs,
            steps: *observations,
            bpw: image.bpw,
            bytes: image.bytes,
            worst_dimension: 0,
        };
        let milliseconds = 1e3 * image.cycles as f64 / CLOCK;
        Some(Point { budget: self.budget, report, milliseconds, rows: image.rows.clone() })
    }
}
