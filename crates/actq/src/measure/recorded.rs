//! Recorded actions that are not the f32 policy's, and what explains the difference.
//!
//! A log often holds what the robot executed: scaled, limited, late, with exploration noise, or in another order of axes.
//! The image learns from the policy, so its errors are measured against the policy, too.

use std::fmt;
use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};

use crate::data::{Dataset, Recordings};
use crate::graph::Graph;
use crate::numbers::square;

/// NMSE up to which recorded actions are the policy's: runs in other arithmetic and actions stored in f16 are closer.
const SAME: f64 = 1e-6;
/// Most MACs of the f32 policy for a comparison, about half a second.
const MAX_MACS: usize = 600_000_000;
/// Frames that are always compared.
const MIN_FRAMES: usize = 200;
/// Steps by which recorded actions may be late, or early if below 0.
const DELAYS: RangeInclusive<isize> = -5..=10;
/// Relative fall of the unexplained part for which a delay, then a mix of axes, is named.
const DELAY_FALL: f64 = 0.5;
const MIX_FALL: f64 = 0.2;
/// The same for factors, offsets and limits.
const NAMED_FALL: f64 = 0.7;
/// Largest unexplained part, as a share of the recorded variance, of a whole explanation.
const EXPLAINED: f64 = 1e-3;
/// Relative size of a factor, an offset or a limit that is named.
const NAMED: f64 = 0.02;
/// The same, in deviations of what remains unexplained.
const NAMED_IN_NOISE: f64 = 0.3;
/// Largest correlation of successive values of noise.
const WHITE: f64 = 0.3;

/// Recorded actions that are not the policy's.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Name of the recording.
    pub recording: String,
    /// Mean over the actions of (mean squared difference / variance of the policy's actions).
    pub nmse: f64,
    /// Explanations of the recorded actions, human-readable; empty if there is none.
    pub causes: Vec<String>,
    /// Part that remains unexplained, as a share of the recorded variance.
    pub rest: f64,
    /// `true` if successive values of this part are independent.
    pub is_noise: bool,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recording, nmse, causes, rest, is_noise } = self;
        write!(f, "{recording}: the recorded actions are not the policy's (NMSE {nmse:.1e} between them): ")?;
        let percent = 100.0 * rest;
        match (causes.is_empty(), *is_noise) {
            (true, true) => write!(f, "the difference looks like noise, {percent:.1}% of their variance")?,
            (true, false) => f.write_str(
                "no factor, offset, limit, delay or order of axes explains them; check that this policy gave them",
            )?,
            (false, _) => f.write_str(&causes.join(", "))?,
        }
        if !causes.is_empty() && *rest > EXPLAINED {
            let what = if *is_noise { "like noise" } else { "unexplained" };
            write!(f, "; {percent:.1}% of their variance remains, {what}")?;
        }
        f.write_str(". Errors are measured against the policy's own actions")
    }
}

/// Removes recorded actions that are not the f32 policy's, so that the policy gives them ([`Dataset::fill_actions`]).
/// Returns how they differ.
pub fn use_policy(recordings: &mut Recordings, graph: &Graph) -> Vec<Difference> {
    let Recordings { calib, heldout } = recordings;
    [calib, heldout].into_iter().flatten().filter_map(|dataset| use_policy_of(dataset, graph)).collect()
}

/// As [`use_policy`], for one recording.
pub fn use_policy_of(dataset: &mut Dataset, graph: &Graph) -> Option<Difference> {
    let difference = difference(dataset, graph)?;
    dataset.action = None;
    Some(difference)
}

/// Compares recorded actions with the f32 policy's; `None` if they agree, or if none are recorded.
pub fn difference(dataset: &Dataset, graph: &Graph) -> Option<Difference> {
    dataset.action.as_ref()?;
    let macs = graph.weights().max(1) * graph.denoising_steps();
    let most = (MAX_MACS / macs).max(MIN_FRAMES);
    // Successive steps show delays; frames from the whole recording show what happens later.
    let in_order = Pairs::of(&dataset.thinned(most, true), graph)?;
    let spread = (graph.state_len() == 0).then(|| Pairs::of(&dataset.thinned(most, false), graph)).flatten();
    let nmse = spread.iter().map(Pairs::nmse).fold(in_order.nmse(), f64::max);
    if nmse <= SAME {
        return None;
    }
    let (causes, rest, is_noise) = in_order.explain();
    Some(Difference { recording: dataset.name().into_owned(), nmse, causes, rest, is_noise })
}

/// The policy's and the recorded actions: a row for each step, episode after episode.
struct Pairs {
    policy: Vec<Vec<f64>>,
    recorded: Vec<Vec<f64>>,
    /// Steps of each episode.
    length: Vec<usize>,
}

impl Pairs {
    fn of(dataset: &Dataset, graph: &Graph) -> Option<Self> {
        let mut of_policy = dataset.clone();
        of_policy.action = None;
        of_policy.fill_actions(graph);
        let rows = |dataset: &Dataset| -> Option<Vec<Vec<f64>>> {
            let places = dataset.length.iter().enumerate().flat_map(|(e, n)| (0..*n).map(move |step| (e, step)));
            places.map(|(e, step)| Some(dataset.action_at(e, step)?.into_iter().map(f64::from).collect())).collect()
        };
        let (policy, recorded) = (rows(&of_policy)?, rows(dataset)?);
        (!policy.is_empty()).then(|| Self { policy, recorded, length: dataset.length.clone() })
    }

    fn axes(&self) -> usize {
        self.policy[0].len()
    }

    fn nmse(&self) -> f64 {
        let of_axis = |i: usize| {
            let [policy, recorded] = [&self.policy, &self.recorded].map(|rows| column(rows, i));
            let square = mean(policy.iter().zip(&recorded).map(|(p, r)| square(p - r)));
            // An axis that never moves has no scale but its own size.
            let scale = variance(&policy).max(1e-6 * mean(policy.iter().map(|p| p * p))).max(f64::MIN_POSITIVE);
            square / scale
        };
        mean((0..self.axes()).map(of_axis))
    }

    /// Returns what the recorded actions are, the part that remains, and `true` if that is like noise.
    fn explain(&self) -> (Vec<String>, f64, bool) {
        let now = Fit::of(self, 0);
        let delayed = DELAYS.filter(|delay| *delay != 0).map(|delay| Fit::of(self, delay));
        let best = delayed.filter(|fit| fit.pairs > 0).min_by(|a, b| a.rest.total_cmp(&b.rest));
        let fit = best.filter(|best| best.rest < DELAY_FALL * now.rest).unwrap_or(now);
        let mut causes = Vec::new();
        match fit.delay {
            0 => (),
            1.. => causes.push(format!("{} late", steps(fit.delay))),
            _ => causes.push(format!("{} early", steps(-fit.delay))),
        }
        if fit.rest > EXPLAINED
            && let Some((mix, rest)) = self.mix(fit.delay).filter(|(_, rest)| *rest < MIX_FALL * fit.rest)
        {
            causes.push(mix);
            return (causes, rest, false);
        }
        causes.extend(fit.causes());
        let rest = if causes.is_empty() { fit.as_is } else { fit.rest };
        (causes, rest, fit.correlation < WHITE)
    }

    /// Returns the steps with their recorded ones `delay` steps later, of the same episode.
    fn delayed(&self, delay: isize) -> impl Iterator<Item = (&Vec<f64>, &Vec<f64>)> + '_ {
        let starts = self.length.iter().scan(0, |next, length| {
            *next += length;
            Some((*next - length, *length))
        });
        starts.flat_map(move |(start, length)| {
            let first = delay.unsigned_abs().min(length);
            let (policy, recorded) = if delay < 0 { (first, 0) } else { (0, first) };
            (0..length - first).map(move |i| (&self.policy[start + policy + i], &self.recorded[start + recorded + i]))
        })
    }

    /// Fits every recorded axis by all of the policy's; returns the text and the part that remains.
    fn mix(&self, delay: isize) -> Option<(String, f64)> {
        let (policy, recorded): (Vec<_>, Vec<_>) = self.delayed(delay).unzip();
        let axes = self.axes();
        if axes < 2 || policy.len() < 10 * (axes + 1) {
            return None;
        }
        let inputs = DMatrix::from_fn(policy.len(), axes + 1, |row, i| policy[row].get(i).copied().unwrap_or(1.0));
        let decomposition = inputs.clone().svd(true, true);
        let (mut rests, mut order) = (Vec::new(), Vec::new());
        for axis in 0..axes {
            let values = DVector::from_iterator(recorded.len(), recorded.iter().map(|row| row[axis]));
            let solution = decomposition.solve(&values, 1e-9).ok()?;
            let rest = (&inputs * &solution - &values).norm_squared() / values.len() as f64;
            rests.push(share(rest, variance(values.as_slice())));
            let sizes: Vec<f64> = (0..axes).map(|i| solution[i].abs()).collect();
            let largest = (0..axes).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]))?;
            let others = sizes.iter().sum::<f64>() - sizes[largest];
            order.push((others < 0.1 * sizes[largest]).then_some(largest));
        }
        let text = match order.into_iter().collect::<Option<Vec<usize>>>() {
            Some(order) => {
                format!("axes in another order: the policy's {}", joined(order.iter().map(usize::to_string)))
            }
            None => "a linear mix of the policy's axes".to_owned(),
        };
        Some((text, mean(rests.into_iter())))
    }
}

/// Every recorded axis as a factor, an offset and limits of the policy's.
struct Fit {
    delay: isize,
    pairs: usize,
    axes: Vec<Axis>,
    /// Part that remains, as a share of the recorded variance, and the correlation of its successive values.
    rest: f64,
    correlation: f64,
    /// The part that remains without factor, offset and limits.
    as_is: f64,
}

struct Axis {
    factor: f64,
    offset: f64,
    /// Recorded limits that the policy exceeds.
    low: Option<f64>,
    high: Option<f64>,
    deviation: f64,
}

impl Fit {
    fn of(pairs: &Pairs, delay: isize) -> Self {
        let (policy, recorded): (Vec<_>, Vec<_>) = pairs.delayed(delay).map(|(p, r)| (p.clone(), r.clone())).unzip();
        if policy.is_empty() {
            return Self { delay, pairs: 0, axes: Vec::new(), rest: f64::INFINITY, correlation: 1.0, as_is: 0.0 };
        }
        let (mut axes, mut rests, mut correlations, mut as_is) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for axis in 0..pairs.axes() {
            let (policy, recorded) = (column(&policy, axis), column(&recorded, axis));
            let fit = Axis::of(&policy, &recorded);
            let rest: Vec<f64> = policy.iter().zip(&recorded).map(|(p, r)| r - fit.give(*p)).collect();
            let left = mean(rest.iter().map(|v| v * v));
            rests.push(share(left, variance(&recorded)));
            as_is.push(share(mean(policy.iter().zip(&recorded).map(|(p, r)| square(r - p))), variance(&recorded)));
            correlations.push(share(mean(rest.windows(2).map(|pair| pair[0] * pair[1])), left));
            axes.push(fit);
        }
        let [rest, correlation, as_is] = [rests, correlations, as_is].map(|of| mean(of.into_iter()));
        Self { delay, pairs: policy.len(), axes, rest, correlation, as_is }
    }

    fn causes(&self) -> Vec<String> {
        // A fit of noise finds small factors and offsets, too.
        if self.rest > NAMED_FALL * self.as_is {
            return Vec::new();
        }
        let least = NAMED.max(NAMED_IN_NOISE * self.rest.sqrt());
        let differs = |a: f64, b: f64, size: f64| (a - b).abs() > least * size;
        let mut causes = Vec::new();
        let by_axis = |of: &dyn Fn(&Axis) -> f64| -> Vec<f64> { self.axes.iter().map(of).collect() };
        if self.axes.iter().any(|axis| differs(axis.factor, 1.0, 1.0)) {
            causes.push(format!("{} times the policy's", values(&by_axis(&|axis| axis.factor))));
        }
        if self.axes.iter().any(|axis| differs(axis.offset, 0.0, axis.deviation)) {
            causes.push(format!("with an offset of {}", values(&by_axis(&|axis| axis.offset))));
        }
        let limit = |of: fn(&Axis) -> Option<f64>| -> Vec<f64> { self.axes.iter().filter_map(of).collect() };
        for (name, limits) in [("at least", limit(|axis| axis.low)), ("at most", limit(|axis| axis.high))] {
            if !limits.is_empty() {
                causes.push(format!("limited to {name} {}", values(&limits)));
            }
        }
        causes
    }
}

impl Axis {
    fn of(policy: &[f64], recorded: &[f64]) -> Self {
        let (low, high) = recorded.iter().fold((f64::MAX, f64::MIN), |(a, b), r| (a.min(*r), b.max(*r)));
        let near = NAMED * NAMED * (high - low);
        // Values that meet the end of the range exactly, again and again, were limited.
        let is_met = |end: f64| recorded.iter().filter(|r| (*r - end).abs() <= 1e-6 * (high - low)).count();
        let [has_low, has_high] = [low, high].map(|end| is_met(end) >= 3 + recorded.len() / 500);
        let is_inside = |r: f64| (!has_low || r > low + near) && (!has_high || r < high - near);
        let inside: Vec<(f64, f64)> =
            policy.iter().copied().zip(recorded.iter().copied()).filter(|(_, r)| is_inside(*r)).collect();
        let (p_mean, r_mean) = (mean(inside.iter().map(|(p, _)| *p)), mean(inside.iter().map(|(_, r)| *r)));
        let square = mean(inside.iter().map(|(p, _)| square(p - p_mean)));
        let factor = share(mean(inside.iter().map(|(p, r)| (p - p_mean) * (r - r_mean))), square);
        let offset = r_mean - factor * p_mean;
        let given = |of: fn(f64, f64) -> f64, from: f64| policy.iter().map(|p| factor * p + offset).fold(from, of);
        let margin = NAMED * (high - low);
        Self {
            factor,
            offset,
            low: (has_low && given(f64::min, f64::MAX) < low - margin).then_some(low),
            high: (has_high && given(f64::max, f64::MIN) > high + margin).then_some(high),
            deviation: variance(recorded).sqrt(),
        }
    }

    fn give(&self, policy: f64) -> f64 {
        let value = self.factor * policy + self.offset;
        value.max(self.low.unwrap_or(f64::MIN)).min(self.high.unwrap_or(f64::MAX))
    }
}

fn column(rows: &[Vec<f64>], axis: usize) -> Vec<f64> {
    rows.iter().map(|row| row[axis]).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

fn variance(values: &[f64]) -> f64 {
    let middle = mean(values.iter().copied());
    mean(values.iter().map(|v| square(v - middle)))
}

/// Returns `part / whole`, 0 without a whole.
fn share(part: f64, whole: f64) -> f64 {
    if whole > f64::MIN_POSITIVE { part / whole } else { 0.0 }
}

fn steps(count: isize) -> String {
    if count == 1 { "1 step".to_owned() } else { format!("{count} steps") }
}

/// Formats the values of the axes: one if they are alike, a list, or a range if they are many.
fn values(of: &[f64]) -> String {
    let (low, high) = of.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    match of.len() {
        _ if high - low <= NAMED * low.abs().max(high.abs()) => significant(mean(of.iter().copied())),
        0..=8 => format!("{} by axis", joined(of.iter().map(|v| significant(*v)))),
        _ => format!("{} to {} by axis", significant(low), significant(high)),
    }
}

fn joined(values: impl Iterator<Item = String>) -> String {
    values.collect::<Vec<_>>().join(", ")
}

/// Formats a number by three digits.
fn significant(value: f64) -> String {
    let places = (2.0 - libm::log10(value.abs().max(1e-9)).floor()).clamp(0.0, 12.0);
    let unit = libm::pow(10.0, places);
    // Not "-0".
    ((value * unit).round() / unit + 0.0).to_string()
}

#[cfg(test)]
mod tests {
    use ndarray::Array3;

    use super::*;
    use crate::random::Random;
    use crate::testing::{layers, lstm};

    /// Makes a smooth walk of four episodes with the network's actions, which `change` turns into recorded ones: it gets
    /// the actions of an episode, a row a step, and random numbers.
    fn recorded(graph: &Graph, change: impl Fn(&[Vec<f32>], &mut Random) -> Vec<Vec<f32>>) -> Option<Difference> {
        let mut random = Random::new(3);
        let mut walk = vec![0.0; graph.obs_len];
        let obs = Array3::from_shape_fn((4, 200, graph.obs_len), |(_, _, i)| {
            walk[i] = 0.9 * walk[i] + random.unit();
            walk[i]
        });
        let mut dataset = Dataset { path: "r.npz".into(), obs, action: None, length: vec![200; 4], state: None };
        dataset.fill_actions(graph);
        let action = dataset.action.as_mut().expect("actions");
        for mut episode in action.outer_iter_mut() {
            let rows: Vec<Vec<f32>> = episode.outer_iter().map(|row| row.to_vec()).collect();
            for (mut row, new) in episode.outer_iter_mut().zip(change(&rows, &mut random)) {
                row.iter_mut().zip(new).for_each(|(to, from)| *to = from);
            }
        }
        let whole = dataset.clone();
        let found = use_policy_of(&mut dataset, graph);
        assert_eq!(dataset.action.is_none(), found.is_some(), "only other actions are removed");
        assert!(dataset.action.is_none() || dataset.action == whole.action);
        found
    }

    fn each(rows: &[Vec<f32>], of: impl Fn(usize, f32) -> f32) -> Vec<Vec<f32>> {
        rows.iter().map(|row| row.iter().enumerate().map(|(i, v)| of(i, *v)).collect()).collect()
    }

    #[test]
    fn causes_of_other_actions_are_named() {
        let graph = layers(&[5, 16, 3]);
        type Change<'a> = &'a dyn Fn(&[Vec<f32>], &mut Random) -> Vec<Vec<f32>>;
        let said = |change: Change<'_>| recorded(&graph, change).expect("they differ").causes.join(", ");
        assert_eq!(said(&|rows, _| each(rows, |_, v| 0.25 * v)), "0.25 times the policy's");
        assert_eq!(said(&|rows, _| each(rows, |_, v| v + 0.5)), "with an offset of 0.5");
        assert_eq!(said(&|rows, _| each(rows, |i, v| [0.5, 1.0, 2.0][i] * v)), "0.5, 1, 2 by axis times the policy's");
        assert_eq!(
            said(&|rows, _| each(rows, |_, v| v.clamp(-0.5, 0.5))),
            "limited to at least -0.5, limited to at most 0.5"
        );
        let scaled = said(&|rows, _| each(rows, |_, v| (0.5 * v).clamp(-0.3, 0.3)));
        assert_eq!(scaled, "0.5 times the policy's, limited to at least -0.3, limited to at most 0.3");
        let late = |rows: &[Vec<f32>], by: usize| (0..rows.len()).map(|t| rows[t.saturating_sub(by)].clone()).collect();
        assert_eq!(said(&|rows, _| late(rows, 1)), "1 step late");
        assert_eq!(said(&|rows, _| each(&late(rows, 3), |_, v| 2.0 * v)), "3 steps late, 2 times the policy's");
        assert_eq!(said(&|rows, _| [&rows[2..], &rows[198..]].concat()), "2 steps early");
        let turned = said(&|rows, _| rows.iter().map(|row| vec![row[1], row[2], row[0]]).collect());
        assert_eq!(turned, "axes in another order: the policy's 1, 2, 0");
        let mixed = said(&|rows, _| rows.iter().map(|r| vec![r[0] + r[1], r[0] - r[1], r[2]]).collect());
        assert_eq!(mixed, "a linear mix of the policy's axes");
    }

    #[test]
    fn noise_and_foreign_actions_are_told_apart() {
        let graph = layers(&[5, 16, 3]);
        let noisy = |rows: &[Vec<f32>], random: &mut Random| -> Vec<Vec<f32>> {
            rows.iter().map(|row| row.iter().map(|v| v + 0.5 * random.unit()).collect()).collect()
        };
        let noise = recorded(&graph, noisy).expect("they differ");
        assert!(noise.causes.is_empty() && noise.is_noise && noise.rest > 0.01, "{noise}");
        assert!(noise.to_string().contains("looks like noise"), "{noise}");
        let foreign = |rows: &[Vec<f32>], _: &mut Random| each(rows, |_, v| (9.0 * v).sin().powi(2));
        let foreign = recorded(&graph, foreign).expect("they differ");
        assert!(foreign.rest > 0.1, "{foreign}");
        let both = |rows: &[Vec<f32>], random: &mut Random| each(&noisy(rows, random), |_, v| 3.0 * v);
        let both = recorded(&graph, both).expect("they differ").to_string();
        assert!(both.contains(" them): 3") && both.contains(" times the policy's; "), "{both}");
        assert!(both.contains("remains, like noise"), "{both}");
    }

    #[test]
    fn actions_of_the_policy_stay_as_recorded() {
        for graph in [layers(&[5, 16, 3]), lstm()] {
            assert!(recorded(&graph, |rows, _| rows.to_vec()).is_none());
            // As stored in half precision.
            assert!(recorded(&graph, |rows, _| each(rows, |_, v| half::f16::from_f32(v).to_f32())).is_none());
            assert!(recorded(&graph, |rows, _| each(rows, |_, v| 1.01 * v)).is_some());
        }
    }
}
