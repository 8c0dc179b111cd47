//! The columns that read one value of the observation, each in a unit of its own.
//!
//! How much a column's error counts is judged with a damped moment, and a limit holds factors together; both compare
//! columns, and so they would go by the units of the observations. In the unit in which its values are as large as its
//! weights a column is the same whatever unit people choose. (Every step here is exact under a power of two.)

use nalgebra::DMatrix;

use super::sites::{Reading, Site};
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{Side, importance};
use crate::graph::Graph;

/// A factor is at most so many times the others' geometric mean, or one over it: the recording need not show how far a
/// value goes.
const MOST: f64 = 32.0;
/// A value whose variance is below this share of its mean square did not move.
const STILL: f64 = 1e-9;
/// With deviations beyond this, or below one over it, learning and statistics in f32 lose squares.
const FAR: f64 = (1u32 << 20) as f64;

/// What the columns that read one value have in common, each in its unit.
#[derive(Debug)]
pub(super) struct Columns {
    /// What the column's own values are multiplied with.
    units: Vec<f64>,
    /// `a`
    pub(super) weights: Vec<f64>,
    /// `h`, about the mean
    values: Vec<f64>,
    /// Standard deviation; 0 where the value did not move.
    pub(super) deviation: Vec<f64>,
    /// In the value's own units.
    pub(super) mean: Vec<f64>,
}

impl Columns {
    pub(super) fn of(graph: &Graph, site: &Site, moments: &[Moments], outputs: &[Vec<f64>]) -> Self {
        let len = graph.len_of(site.value);
        let mut weights = vec![0.0; len];
        for reading in &site.readings {
            let matrix = &graph.matrices[reading.matrix];
            for (row, g) in matrix.data.chunks_exact(matrix.cols).zip(&outputs[reading.matrix]) {
                reading.columns().for_each(|(c, e)| weights[e] += g * f64::from(row[c]).powi(2));
            }
        }
        let moments = joint(len, &site.readings, moments);
        let centred = moments.centred();
        let deviation = deviations(&moments);
        let read = Read { weights, deviation, centred, mean: moments.mean };
        // What the policy normalizes has the units that it was trained with, unless they are too far apart.
        let as_it_is = site.normalized.then(|| read.in_units(vec![1.0; len]));
        as_it_is.filter(|columns| !columns.are_limited()).unwrap_or_else(|| read.standardized())
    }

    /// Bits that each weight can do without for the error that it has.
    pub(super) fn saved_bits(&self) -> f64 {
        let (weights, values) = self.as_they_are();
        lost_bits(&weights, &values)
    }

    /// `a` and `h` in the values' own units.
    pub(super) fn as_they_are(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |values: &[f64], factor: &dyn Fn(f64) -> f64| -> Vec<f64> {
            values.iter().zip(&self.units).map(|(value, unit)| value * factor(*unit)).collect()
        };
        (of(&self.weights, &|unit| unit * unit), of(&self.values, &|unit| (unit * unit).recip()))
    }

    /// Whether a value is so large or small that only a factor brings it where f32 can square it.
    pub(super) fn is_far(&self, column: usize) -> bool {
        self.is_beyond(column, FAR)
    }

    /// Whether a value's mean or deviation is above `most`, or its deviation below one over it.
    pub(super) fn is_beyond(&self, column: usize, most: f64) -> bool {
        let deviation = self.deviation[column] / self.units[column];
        self.mean[column].abs() > most || deviation > 0.0 && !(1.0 / most..=most).contains(&deviation)
    }

    /// Whether the values are so large or small that only a factor brings them where f32 can square them.
    pub(super) fn are_far(&self) -> bool {
        let deviations = self.deviation.iter().zip(&self.units).filter(|(d, _)| **d > 0.0).map(|(d, u)| d / u);
        geometric_mean(deviations).is_some_and(|usual| !(1.0 / FAR..=FAR).contains(&usual))
    }

    /// `(a / h)^(1/4)`, without a limit.
    fn wanted(&self) -> Vec<f64> {
        let root = |a: f64, h: f64| (a.max(f64::MIN_POSITIVE) / h).powf(0.25);
        self.weights.iter().zip(&self.values).map(|(a, h)| root(*a, *h)).collect()
    }

    /// The geometric mean of the factors of columns that have weights.
    fn usual(&self, factors: &[f64]) -> Option<f64> {
        geometric_mean(factors.iter().zip(&self.weights).filter(|(_, a)| **a > 0.0).map(|(factor, _)| *factor))
    }

    /// Whether the limit changes the factor of a column that has weights.
    fn are_limited(&self) -> bool {
        let factors = self.wanted();
        let Some(usual) = self.usual(&factors) else { return false };
        let beyond = |factor: &f64| !(usual / MOST..=usual * MOST).contains(factor);
        factors.iter().zip(&self.weights).any(|(factor, a)| *a > 0.0 && beyond(factor))
    }

    /// `d` but for a common factor, and the factor that makes the deviations of what moved 1 in the geometric mean; `None`
    /// where nothing moved.
    pub(super) fn factors(&self) -> Option<(Vec<f64>, f64)> {
        let (factors, cols) = (self.wanted(), 0..self.mean.len());
        let usual = self.usual(&factors)?;
        let limited = |c: usize| factors[c].clamp(usual / MOST, usual * MOST);
        let moved = cols.clone().filter(|&c| self.deviation[c] > 0.0);
        let unit = geometric_mean(moved.map(|c| limited(c) * self.deviation[c]))?;
        Some((cols.map(|c| self.units[c] * limited(c)).collect(), unit))
    }
}

/// What is read of a value, in its own units.
struct Read {
    weights: Vec<f64>,
    deviation: Vec<f64>,
    centred: DMatrix<f64>,
    mean: Vec<f64>,
}

impl Read {
    /// With what each column's values are multiplied with.
    fn in_units(&self, units: Vec<f64>) -> Columns {
        let second = self.centred.map_with_location(|i, j, v| v * (units[i] * units[j]));
        Columns {
            weights: self.weights.iter().zip(&units).map(|(a, u)| a / (u * u)).collect(),
            values: importance(&second, Side::Input),
            deviation: self.deviation.iter().zip(&units).map(|(d, u)| d * u).collect(),
            mean: self.mean.clone(),
            units,
        }
    }

    /// In the columns' own units. The recording does not show how far a value goes that did not move: it counts as one
    /// that moves as far as the others.
    fn standardized(mut self) -> Columns {
        let (units, usual) = units(&self.weights, &self.deviation);
        for (c, unit) in units.iter().enumerate().filter(|(c, _)| self.deviation[*c] == 0.0) {
            self.centred.row_mut(c).fill(0.0);
            self.centred.column_mut(c).fill(0.0);
            self.centred[(c, c)] = (usual / unit).powi(2);
        }
        self.in_units(units)
    }
}

/// What makes each column's values as large as its weights, and how large they usually are then; a column that has only
/// one of both gets the usual size.
fn units(weights: &[f64], deviation: &[f64]) -> (Vec<f64>, f64) {
    let columns = || weights.iter().map(|a| a.sqrt()).zip(deviation);
    let sizes = columns().map(|(w, d)| (w * d).sqrt()).filter(|size| *size > 0.0);
    let usual = geometric_mean(sizes).unwrap_or(1.0);
    let unit = |(w, d): (f64, &f64)| match (w > 0.0, *d > 0.0) {
        (true, true) => (w / d).sqrt(),
        (true, false) => w / usual,
        (false, true) => usual / d,
        (false, false) => 1.0,
    };
    (columns().map(unit).collect(), usual)
}

/// The standard deviation of each value; 0 where it did not move.
pub(super) fn deviations(moments: &Moments) -> Vec<f64> {
    let centred = moments.centred();
    let moves = |c: usize| centred[(c, c)] > STILL * moments.second[(c, c)];
    (0..centred.nrows()).map(|c| if moves(c) { centred[(c, c)].sqrt() } else { 0.0 }).collect()
}

/// Bits of each weight that columns lose by weighing unlike: half of the logarithm of what balancing would leave of the
/// error.
pub(super) fn lost_bits(weights: &[f64], values: &[f64]) -> f64 {
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let balanced = weights.iter().zip(values).map(|(a, h)| (a * h).sqrt()).sum::<f64>().powi(2);
    0.5 * (sum(weights) * sum(values) / balanced.max(f64::MIN_POSITIVE)).log2()
}

/// Moments of the elements of a value, as far as matrices read them.
fn joint(len: usize, readings: &[Reading], moments: &[Moments]) -> Moments {
    let mut joint = Moments { second: DMatrix::zeros(len, len), mean: vec![0.0; len], count: 0 };
    for reading in readings {
        let moments = &moments[reading.matrix];
        for (i, e) in reading.columns() {
            joint.mean[e] = moments.mean[i];
            reading.columns().for_each(|(j, f)| joint.second[(e, f)] = moments.second[(i, j)]);
        }
    }
    joint
}

/// `None` of nothing.
fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value.ln(), count + 1));
    (count > 0).then(|| (sum / count as f64).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_changes_no_column_of_its_own_unit() {
        let (weights, deviation) = ([4.0, 9.0, 0.0, 1.0, 0.0], [3.0, 0.5, 2.0, 0.0, 0.0]);
        let (found, usual) = units(&weights, &deviation);
        for factor in [2f64.powi(-60), 0.125, 2f64.powi(20)] {
            let (mut weights, mut deviation) = (weights, deviation);
            for c in [0, 2, 3] {
                weights[c] /= factor * factor;
                deviation[c] *= factor;
            }
            let (scaled, same) = units(&weights, &deviation);
            assert_eq!(same, usual);
            for (c, of) in [factor, 1.0, factor, factor, 1.0].into_iter().enumerate() {
                assert!((scaled[c] * of / found[c] - 1.0).abs() < 1e-12, "{c}: {scaled:?} {found:?}");
            }
        }
    }

    #[test]
    fn columns_without_weights_or_movement_get_the_others_size() {
        let found = units(&[16.0, 0.0, 25.0, 0.0], &[1.0, 8.0, 0.0, 0.0]);
        assert!(found.0.iter().zip([2.0, 0.25, 2.5, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
