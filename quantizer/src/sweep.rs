//! The error of several methods at several budgets on one policy or several, as a table, as JSON and as a plot.

use std::collections::BTreeMap;
use std::path::Path;

use actq_kernels::Width;
use anyhow::Result;
use comfy_table::Table;
use serde::Serialize;

use crate::dataset::Dataset;
use crate::plot::{Mark, Plot, Series, stacked};
use crate::policy::Policy;
use crate::quantize::prepared::Prepared;
use crate::quantize::{Budget, BudgetTooSmall, Method, Options, Outcome};
use crate::runtime::ImageBuffer;
use crate::stats::HsicScore;
use crate::{eval, inspect, writer};

/// One image.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Bits per weight that were allowed.
    pub budget: f64,
    /// Errors, true bits per weight, bytes.
    #[serde(flatten)]
    pub report: eval::Report,
    /// The allocation: for each matrix how many of its rows, as it was trained, have how many bits (0: none).
    pub rows: Vec<BTreeMap<u32, usize>>,
}

/// One method at all budgets.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// The method's name.
    pub method: String,
    /// One per budget; `None` where the budget is too small for the method.
    pub points: Vec<Option<Point>>,
    /// ActQuant's scores, per matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scores: Option<Vec<HsicScore>>,
}

/// The point of the best method beyond which a further bit gains least.
#[derive(Clone, Debug, Serialize)]
pub struct Knee {
    /// The method.
    pub method: String,
    /// True bits per weight.
    pub bpw: f64,
    /// Its error.
    pub nmse: f64,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Sweep {
    /// The policy's name.
    pub policy: String,
    /// The names of its matrices.
    pub matrices: Vec<String>,
    /// Bits per weight that were allowed.
    pub budgets: Vec<f64>,
    /// One per method.
    pub curves: Vec<Curve>,
    /// See [`knee`].
    pub knee: Option<Knee>,
}

/// What to compare.
#[derive(Debug)]
pub struct Plan<'a> {
    /// The policy.
    pub policy: &'a Policy,
    /// What the methods learn from; only rtn does without.
    pub calib: Option<&'a Dataset>,
    /// What errors are measured on, with actions.
    pub heldout: &'a Dataset,
    /// The methods.
    pub methods: &'a [Method],
    /// Bits per weight that are allowed.
    pub budgets: &'a [f64],
    /// Steps of distillation; None: as many as suit the network.
    pub steps: Option<usize>,
    /// Seed of everything that is drawn.
    pub seed: u64,
}

/// Quantizes the policy by every method for every budget and runs each image over the held-out recording. `progress` gets what
/// is being done and the share of the whole that is done.
pub fn run(plan: &Plan<'_>, mut progress: impl FnMut(&str, f64)) -> Result<Sweep> {
    let Plan { policy, calib, heldout, methods, budgets, steps, seed } = *plan;
    let mut curves = Vec::new();
    for (m, &method) in methods.iter().enumerate() {
        // Calibration counts as much as one budget.
        let done = |steps: f64| (m as f64 + steps / (1 + budgets.len()) as f64) / methods.len() as f64;
        let work = format!("{method}, calibrating");
        let prepared = Prepared::with_recording(policy, method, calib, |share| progress(&work, done(share)))?;
        let mut points = Vec::new();
        for (b, &budget) in budgets.iter().enumerate() {
            let work = format!("{method}, {budget} bits per weight");
            let plain = Options::new(method, Budget::BitsPerWeight(budget));
            let options = Options { group: method.default_group(), steps, seed, ..plain };
            let share = |share| progress(&work, done(1.0 + b as f64 + share));
            points.push(point(heldout, &prepared, budget, &options, share)?);
        }
        let scores = prepared.actquant.map(|statistics| statistics.scores.iter().map(HsicScore::from).collect());
        curves.push(Curve { method: method.to_string(), points, scores });
    }
    let knee = knee(&curves);
    let matrices = policy.graph.matrices.iter().map(|m| m.name.clone()).collect();
    Ok(Sweep { policy: policy.name.clone(), matrices, budgets: budgets.to_vec(), curves, knee })
}

fn point(
    heldout: &Dataset,
    prepared: &Prepared<'_>,
    budget: f64,
    options: &Options,
    progress: impl FnMut(f64),
) -> Result<Option<Point>> {
    let (quantized, outcomes) = match prepared.quantize(options, progress) {
        Ok(found) => found,
        Err(error) if error.is::<BudgetTooSmall>() => return Ok(None),
        Err(error) => return Err(error),
    };
    let buffer = ImageBuffer::new(&writer::image(&quantized, &outcomes)?);
    let image = buffer.image(Path::new("image in memory"))?;
    let report = eval::evaluate(image, heldout)?;
    Ok(Some(Point { budget, report, rows: outcomes.iter().map(rows).collect() }))
}

fn rows(outcome: &Outcome) -> BTreeMap<u32, usize> {
    let mut rows = BTreeMap::new();
    for width in outcome.trained_widths() {
        *rows.entry(width.map_or(0, Width::bits)).or_default() += 1;
    }
    rows
}

/// The knee of the best method.
///
/// The best method has the lowest error at most budgets; among equals, the one named first. Its knee is the point furthest below
/// the chord from its first point to its last, in log error over true bits per weight: up to there a bit gains more than on
/// average, after it less. `None` where no point is below the chord.
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
    let line = line(&curves[best]);
    let (&(x0, y0), &(x1, y1)) = (line.first()?, line.last()?);
    let below = |&(x, y): &(f64, f64)| y0.ln() + (y1 / y0).ln() * (x - x0) / (x1 - x0) - y.ln();
    let (depth, (bpw, nmse)) = line.iter().map(|point| (below(point), *point)).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (depth > 1e-9).then(|| Knee { method: curves[best].method.clone(), bpw, nmse })
}

/// True bits per weight and error of a curve's points, from few bits to many, each image once. An error of 0 has no logarithm;
/// it counts as the smallest that f32 actions can show.
fn line(curve: &Curve) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> =
        curve.points.iter().flatten().map(|p| (p.report.bpw, p.report.nmse.max(1e-14))).collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    line.dedup();
    line
}

impl Sweep {
    fn plot(&self) -> Plot {
        let series = |curve: &Curve| Series { name: curve.method.clone(), points: line(curve) };
        Plot {
            title: format!("{}: action error over bits per weight", self.policy),
            x_label: "bits per weight, everything counted".to_owned(),
            y_label: "NMSE of the actions, held-out observations".to_owned(),
            series: self.curves.iter().map(series).collect(),
            mark: self.knee.as_ref().map(|knee| Mark {
                at: (knee.bpw, knee.nmse),
                label: format!("knee: {:.2} bits, NMSE {:.2e}", knee.bpw, knee.nmse),
            }),
        }
    }

    /// Whether a point is the knee.
    fn is_knee(&self, curve: &Curve, point: &Point) -> bool {
        self.knee.as_ref().is_some_and(|knee| knee.method == curve.method && knee.bpw == point.report.bpw)
    }
}

/// One row per policy and budget, one column per method: error and true bits per weight, and a star at each policy's knee. All
/// sweeps have the same methods.
pub fn table(sweeps: &[Sweep]) -> Table {
    let methods = sweeps.first().map_or(&[][..], |sweep| &sweep.curves).iter().map(|c| c.method.as_str());
    let header: Vec<&str> = ["policy", "budget"].into_iter().chain(methods).collect();
    let mut table = inspect::table(&header);
    for sweep in sweeps {
        for (b, budget) in sweep.budgets.iter().enumerate() {
            let cell = |curve: &Curve| match &curve.points[b] {
                Some(point) => {
                    let star = if sweep.is_knee(curve, point) { '*' } else { ' ' };
                    format!("{:.2e} at {:.3}{star}", point.report.nmse, point.report.bpw)
                }
                None => "- ".to_owned(),
            };
            let name = if b == 0 { sweep.policy.clone() } else { String::new() };
            let front = [name, format!("{budget} bits")];
            table.add_row(front.into_iter().chain(sweep.curves.iter().map(cell)));
        }
    }
    table
}

/// Error over true bits per weight, a line per method, a plot per policy.
pub fn svg(sweeps: &[Sweep]) -> String {
    stacked(&sweeps.iter().map(Sweep::plot).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(method: &str, points: &[(f64, f64)]) -> Curve {
        let point = |&(bpw, nmse): &(f64, f64)| {
            let report =
                eval::Report { nmse, worst_nmse: nmse, max_abs: 0.0, steps: 1, bpw, bytes: 1, worst_dimension: 0 };
            (nmse > 0.0).then_some(Point { budget: bpw, report, rows: Vec::new() })
        };
        Curve { method: method.to_owned(), points: points.iter().map(point).collect(), scores: None }
    }

    #[test]
    fn the_knee_is_where_the_best_curve_bends() {
        let worse = curve("worse", &[(2.0, 0.9), (2.5, 0.8), (3.0, 0.5), (4.0, 1e-4)]);
        let better = curve("better", &[(2.0, 0.5), (2.5, 0.01), (3.0, 0.006), (4.0, 0.003)]);
        let found = knee(&[worse.clone(), better]).expect("a knee");
        assert_eq!((found.method.as_str(), found.bpw), ("better", 2.5));
        assert!(knee(&[worse]).is_none(), "a curve above its chord has no knee");
        assert!(knee(&[]).is_none());
        assert!(knee(&[curve("one", &[(3.0, 0.1)])]).is_none());
    }

    #[test]
    fn the_table_has_every_policy_and_marks_its_knee() {
        let sweep = |policy: &str, points| {
            let curves = vec![curve("best", points)];
            let knee = knee(&curves);
            let budgets = vec![2.0, 2.5, 4.0];
            Sweep { policy: policy.into(), matrices: Vec::new(), budgets, curves, knee }
        };
        let sweeps = [
            sweep("arm", &[(2.0, 0.5), (2.5, 0.01), (4.0, 0.003)]),
            sweep("leg", &[(2.0, 0.5), (2.5, 0.4), (4.0, 0.003)]),
        ];
        let text = table(&sweeps).to_string();
        let line = |word: &str| text.lines().filter(|l| l.contains(word)).map(str::to_owned).collect::<Vec<_>>();
        assert!(line("arm")[0].contains("5.00e-1 at 2.000") && line("leg").len() == 1, "{text}");
        assert_eq!(line("*").len(), 1, "{text}");
        assert!(line("*")[0].contains("1.00e-2 at 2.500*"), "{text}");
        assert_eq!(svg(&sweeps).matches("<polyline").count(), 2);
    }

    #[test]
    fn a_budget_that_is_too_small_leaves_a_dash() {
        let curves = vec![curve("a", &[(2.0, 0.0), (3.0, 0.1)])];
        let sweep = Sweep { policy: "p".into(), matrices: Vec::new(), budgets: vec![2.0, 3.0], curves, knee: None };
        let text = table(&[sweep]).to_string();
        assert!(text.contains('-') && text.contains("1.00e-1 at 3.000"), "{text}");
    }
}
