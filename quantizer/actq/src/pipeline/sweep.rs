//! Errors of several methods at several budgets on a policy.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;

use super::quantizer::{QuantizedPolicy, Quantizer};
use super::watch::Watch;
use crate::budget::Budget;
use crate::data::{Dataset, Recording, Recordings};
use crate::error::{Context as _, Result};
use crate::measure::eval;
use crate::measure::time::StepTime;
use crate::methods::{Effort, Method, Options, Outcome};
use crate::policy::Policy;

/// One image of a sweep.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Allowed bits per weight.
    pub budget: f64,
    /// Errors, true bits per weight, bytes.
    #[serde(flatten)]
    pub report: eval::ErrorReport,
    /// Predicted milliseconds of a step at the sweep's clock.
    pub milliseconds: f64,
    /// Bit allocation: for each matrix, the number of trained rows of each width (0: no bits).
    pub rows: Vec<BTreeMap<u32, usize>>,
}

/// Images of one method at all budgets.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// The method's name.
    pub method: String,
    /// One image per budget; `None` if the budget is too small for the method.
    pub points: Vec<Option<Point>>,
    /// Figures of a custom method per matrix; empty for other methods.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scores: Vec<BTreeMap<String, f64>>,
}

/// Point of the best method after which a further byte gains least.
#[derive(Clone, Debug, Serialize)]
pub struct Knee {
    /// The method.
    pub method: String,
    /// True bits per weight.
    pub bpw: f64,
    /// Bytes of the image.
    pub bytes: usize,
    /// Predicted milliseconds of a step at the sweep's clock.
    pub milliseconds: f64,
    /// Error (NMSE).
    pub nmse: f64,
}

/// Result of a sweep.
#[derive(Clone, Debug, Serialize)]
pub struct Sweep {
    /// The policy's name.
    pub policy: String,
    /// Names of its matrices.
    pub matrices: Vec<String>,
    /// Allowed bits per weight.
    pub budgets: Vec<f64>,
    /// Clock of all predicted times in Hz, of a Cortex-M4 with FPU and memory that never waits.
    pub clock_hz: f64,
    /// One curve per method.
    pub curves: Vec<Curve>,
    /// The [`knee`].
    pub knee: Option<Knee>,
}

/// Policy, methods and budgets of a sweep.
#[derive(Debug)]
pub struct SweepPlan<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// Recordings to learn from (only rtn needs none) and to measure errors on. The f32 policy fills in missing
    /// actions.
    pub recordings: Recordings,
    /// The methods.
    pub methods: &'a [Method],
    /// Allowed bits per weight.
    pub budgets: &'a [f64],
    /// The processor's clock in Hz, for predicted times.
    pub clock_hz: f64,
    /// Most steps of distillation; `None`: chosen for the network.
    pub steps: Option<usize>,
    /// Effort, if the steps are not given.
    pub effort: Effort,
    /// Most minutes of distillation; `None`: no limit but the steps.
    pub minutes: Option<f64>,
    /// `true` if method distill weighs errors relative to the action's size.
    pub relative: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Quantizes the policy by every method for every budget, and runs each image over the held-out recording. `watch`
/// receives the present work and the share of the whole that is done.
pub fn run(plan: SweepPlan<'_>, mut watch: impl Watch) -> Result<Sweep> {
    let SweepPlan { policy, mut recordings, methods, budgets, clock_hz, steps, effort, minutes, relative, seed } = plan;
    recordings.fill_actions(&policy.graph);
    let heldout = recordings.heldout.as_ref().with_context(|| Recording::Heldout.missing("a sweep"))?;
    let mut curves = Vec::new();
    for (m, method) in methods.iter().enumerate() {
        // Calibration counts as much as one budget.
        let done = |steps: f64| (m as f64 + steps / (1 + budgets.len()) as f64) / methods.len() as f64;
        let work = format!("{method}, calibrating");
        let quantizer =
            Quantizer::new(policy, &recordings, method.clone(), minutes, |share| watch.progress(&work, done(share)))?;
        let mut points = Vec::new();
        for (b, &budget) in budgets.iter().enumerate() {
            let work = format!("{method}, {budget} bits per weight");
            let plain = Options::new(method.clone(), Budget::BitsPerWeight(budget));
            let relative = relative && *method == Method::Distill;
            let options = Options { group: method.default_group(), steps, effort, minutes, relative, seed, ..plain };
            let share = |_: &str, share: f64| watch.progress(&work, done(1.0 + b as f64 + share));
            points.push(match quantizer.quantize(&options, share) {
                Ok(quantized) => Some(point(heldout, budget, clock_hz, &quantized)?),
                Err(error) if error.budget().is_some() => None,
                Err(error) => return Err(error),
            });
        }
        curves.push(Curve { method: method.to_string(), points, scores: quantizer.method().scores() });
    }
    let knee = knee(&curves);
    let matrices = policy.graph.matrices.iter().map(|m| m.name.clone()).collect();
    Ok(Sweep { policy: policy.name.clone(), matrices, budgets: budgets.to_vec(), clock_hz, curves, knee })
}

fn point(heldout: &Dataset, budget: f64, clock_hz: f64, quantized: &QuantizedPolicy) -> Result<Point> {
    let buffer = quantized.buffer();
    let image = buffer.image(Path::new("image in memory"))?;
    let report = eval::evaluate(image, heldout)?;
    let milliseconds = StepTime::new(&image, clock_hz).milliseconds;
    Ok(Point { budget, report, milliseconds, rows: quantized.outcomes.iter().map(Outcome::trained_rows).collect() })
}

/// Finds the knee of the best method.
///
/// The best method has the lowest error at most budgets; among equals, it is the one named first. Its knee is the point
/// furthest below the chord from its first point to its last, in log error over bytes of the image. Before the knee a
/// byte gains more than on average, after it less. `None` if no point is below the chord.
pub fn knee(curves: &[Curve]) -> Option<Knee> {
    let budgets = curves.iter().map(|c| c.points.len()).max()?;
    let mut wins = vec![0; curves.len()];
    for budget in 0..budgets {
        let error = |c: usize| Some((c, curves[c].points.get(budget)?.as_ref()?.report.nmse));
        if let Some((best, _)) = (0..curves.len()).filter_map(error).min_by(|a, b| a.1.total_cmp(&b.1)) {
            wins[best] += 1;
        }
    }
    let best = (0..curves.len()).rev().max_by_key(|&c| wins[c])?;
    let mut points: Vec<&Point> = curves[best].points.iter().flatten().collect();
    points.sort_by_key(|point| point.report.bytes);
    let at = |point: &Point| (point.report.bytes as f64, drawn_error(point));
    let ((x0, y0), (x1, y1)) = (at(points.first()?), at(points.last()?));
    let below = |point: &Point| {
        let (x, y) = at(point);
        y0.ln() + (y1 / y0).ln() * (x - x0) / (x1 - x0) - y.ln()
    };
    let (depth, point) = points.iter().map(|point| (below(point), *point)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (depth > 1e-9).then(|| Knee {
        method: curves[best].method.clone(),
        bpw: point.report.bpw,
        bytes: point.report.bytes,
        milliseconds: point.milliseconds,
        nmse: point.report.nmse,
    })
}

/// Returns a point's error for a logarithmic axis. An error of 0 has no logarithm; it counts as the smallest that f32
/// actions can show.
pub fn drawn_error(point: &Point) -> f64 {
    point.report.nmse.max(1e-14)
}

/// Returns the points of a line that no other one beats: all with less of the second value than every point with at
/// most as much of the first.
pub fn frontier(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut least = f64::INFINITY;
    points.retain(|&(_, y)| {
        let better = y < least;
        least = least.min(y);
        better
    });
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(method: &str, points: &[(f64, f64)]) -> Curve {
        let point = |&(bpw, nmse): &(f64, f64)| {
            let bytes = (1000.0 * bpw) as usize;
            let report =
                eval::ErrorReport { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 1, bpw, bytes, worst_dimension: 0 };
            let (budget, milliseconds) = (bpw, 0.5 * bpw);
            (nmse > 0.0).then_some(Point { budget, report, milliseconds, rows: Vec::new() })
        };
        Curve { method: method.to_owned(), points: points.iter().map(point).collect(), scores: Vec::new() }
    }

    #[test]
    fn the_knee_is_the_bend_of_the_best_curve() {
        let worse = curve("worse", &[(2.0, 0.9), (2.5, 0.8), (3.0, 0.5), (4.0, 1e-4)]);
        let better = curve("better", &[(2.0, 0.5), (2.5, 0.01), (3.0, 0.006), (4.0, 0.003)]);
        let found = knee(&[worse.clone(), better]).expect("a knee");
        assert_eq!((found.method.as_str(), found.bpw), ("better", 2.5));
        assert_eq!((found.bytes, found.milliseconds), (2500, 1.25));
        assert!(knee(&[worse]).is_none(), "a curve above its chord has no knee");
        assert!(knee(&[]).is_none());
        assert!(knee(&[curve("one", &[(3.0, 0.1)])]).is_none());
    }
    #[test]
    fn no_other_point_beats_the_frontier() {
        let points = vec![(3.0, 0.2), (1.0, 0.9), (2.0, 0.9), (3.0, 0.1), (4.0, 0.3), (5.0, 0.01)];
        assert_eq!(frontier(points), [(1.0, 0.9), (3.0, 0.1), (5.0, 0.01)]);
        assert_eq!(frontier(Vec::new()), []);
    }
}
