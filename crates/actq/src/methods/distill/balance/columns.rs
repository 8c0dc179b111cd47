//! The columns that read one value of the observation, each in its own unit.
//!
//! A damped moment gives the importance of a column's error, and a limit bounds the ratio of factors. Both compare
//! columns, so in the observations' units both would depend on these units. Here the unit of a column makes its values
//! as large as its weights. The column is then the same for every unit that users choose. (Every step here is exact
//! under a power of two.)

use nalgebra::DMatrix;

use super::sites::{Reading, Site};
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{Side, importance};
use crate::graph::Graph;
use crate::numbers::square;

/// Maximum ratio of a factor to the geometric mean of the factors, or of this mean to a factor. The recording may not
/// show the full range of a value.
const MAX_FACTOR_RATIO: f64 = 32.0;
/// Maximum variance of a value that did not move, as a share of its mean square.
const STILL_SHARE: f64 = 1e-9;
/// Maximum deviation, and reciprocal of the minimum: beyond them, learning and statistics in f32 lose squares.
const MAX_DEVIATION: f64 = (1u32 << 20) as f64;

/// Statistics of the columns that read one value, each column in its own unit.
#[derive(Debug)]
pub(super) struct Columns {
    /// Factors that convert values to the columns' units.
    units: Vec<f64>,
    /// `a`, the sum of squared weights, weighted by the importance of their rows.
    pub(super) weights: Vec<f64>,
    /// `h`, the importance of the values about their mean.
    values: Vec<f64>,
    /// Standard deviation; 0 if the value did not move.
    pub(super) deviation: Vec<f64>,
    /// Mean in the value's own unit.
    pub(super) mean: Vec<f64>,
}

impl Columns {
    /// Computes the columns of a site from the moments of its matrices and the importance of their rows.
    pub(super) fn of(graph: &Graph, site: &Site, moments: &[Moments], outputs: &[Vec<f64>]) -> Self {
        let len = graph.len_of(site.value);
        let mut weights = vec![0.0; len];
        for reading in &site.readings {
            let matrix = &graph.matrices[reading.matrix];
            for (row, g) in matrix.data.chunks_exact(matrix.cols).zip(&outputs[reading.matrix]) {
                reading.columns().for_each(|(c, e)| weights[e] += g * square(f64::from(row[c])));
            }
        }
        let moments = joint(len, &site.readings, moments);
        let centred = moments.centred();
        let deviation = deviations(&moments);
        let read = RawColumns { weights, deviation, centred, mean: moments.mean };
        // A normalized value keeps the units of the training, unless they are too far apart.
        let unconverted = site.is_normalized.then(|| read.in_units(vec![1.0; len]));
        unconverted.filter(|columns| !columns.are_limited()).unwrap_or_else(|| read.standardized())
    }

    /// Computes the bits per weight that balancing saves at the same error.
    pub(super) fn saved_bits(&self) -> f64 {
        let (weights, values) = self.in_value_units();
        lost_bits(&weights, &values)
    }

    /// Returns `a` and `h` in the values' own units.
    pub(super) fn in_value_units(&self) -> (Vec<f64>, Vec<f64>) {
        let of = |values: &[f64], factor: &dyn Fn(f64) -> f64| -> Vec<f64> {
            values.iter().zip(&self.units).map(|(value, unit)| value * factor(*unit)).collect()
        };
        (of(&self.weights, &|unit| unit * unit), of(&self.values, &|unit| (unit * unit).recip()))
    }

    /// `true` if a value is so large or small that f32 can square it only after a factor is applied.
    pub(super) fn is_outlier(&self, column: usize) -> bool {
        self.is_beyond(column, MAX_DEVIATION)
    }

    /// `true` if a value's mean or deviation is above `most`, or if it moved and its deviation is below `1 / most`.
    pub(super) fn is_beyond(&self, column: usize, most: f64) -> bool {
        let deviation = self.deviation[column] / self.units[column];
        self.mean[column].abs() > most || deviation > 0.0 && !(1.0 / most..=most).contains(&deviation)
    }

    /// `true` if the values are usually so large or small that f32 can square them only after a factor is applied.
    pub(super) fn has_outliers(&self) -> bool {
        let deviations = self.deviation.iter().zip(&self.units).filter(|(d, _)| **d > 0.0).map(|(d, u)| d / u);
        geometric_mean(deviations).is_some_and(|usual| !(1.0 / MAX_DEVIATION..=MAX_DEVIATION).contains(&usual))
    }

    /// Computes `(a / h)^(1/4)`, without a limit.
    fn unlimited_factors(&self) -> Vec<f64> {
        let root = |a: f64, h: f64| (a.max(f64::MIN_POSITIVE) / h).sqrt().sqrt();
        self.weights.iter().zip(&self.values).map(|(a, h)| root(*a, *h)).collect()
    }

    /// Computes the geometric mean of the factors of columns that have weights.
    fn usual_factor(&self, factors: &[f64]) -> Option<f64> {
        geometric_mean(factors.iter().zip(&self.weights).filter(|(_, a)| **a > 0.0).map(|(factor, _)| *factor))
    }

    /// `true` if the limit changes the factor of a column that has weights.
    fn are_limited(&self) -> bool {
        let factors = self.unlimited_factors();
        let Some(usual) = self.usual_factor(&factors) else { return false };
        let beyond = |factor: &f64| !(usual / MAX_FACTOR_RATIO..=usual * MAX_FACTOR_RATIO).contains(factor);
        factors.iter().zip(&self.weights).any(|(factor, a)| *a > 0.0 && beyond(factor))
    }

    /// Computes `d` up to a common factor, and a divisor of `d`. After the division, the deviations of the
    /// values that moved have the geometric mean 1. Returns `None` if nothing moved.
    pub(super) fn factors(&self) -> Option<(Vec<f64>, f64)> {
        let (factors, cols) = (self.unlimited_factors(), 0..self.mean.len());
        let usual = self.usual_factor(&factors)?;
        let limited = |c: usize| factors[c].clamp(usual / MAX_FACTOR_RATIO, usual * MAX_FACTOR_RATIO);
        let moved = cols.clone().filter(|&c| self.deviation[c] > 0.0);
        let unit = geometric_mean(moved.map(|c| limited(c) * self.deviation[c]))?;
        Some((cols.map(|c| self.units[c] * limited(c)).collect(), unit))
    }
}

/// Statistics of the columns that read one value, in its own units.
struct RawColumns {
    weights: Vec<f64>,
    deviation: Vec<f64>,
    centred: DMatrix<f64>,
    mean: Vec<f64>,
}

impl RawColumns {
    /// Converts to columns; `units` are the factors on each column's values.
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

    /// Converts to the columns' own units. The recording does not show the range of a value that did not move: it
    /// counts as a value that moves as far as the others.
    fn standardized(mut self) -> Columns {
        let (units, usual) = units(&self.weights, &self.deviation);
        for (c, unit) in units.iter().enumerate().filter(|(c, _)| self.deviation[*c] == 0.0) {
            self.centred.row_mut(c).fill(0.0);
            self.centred.column_mut(c).fill(0.0);
            self.centred[(c, c)] = square(usual / unit);
        }
        self.in_units(units)
    }
}

/// Computes the factors that make each column's values as large as its weights, and the usual size after that. A column
/// that has only one of both gets the usual size.
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

/// Computes the standard deviation of each value; 0 if it did not move.
pub(super) fn deviations(moments: &Moments) -> Vec<f64> {
    let centred = moments.centred();
    let moves = |c: usize| centred[(c, c)] > STILL_SHARE * moments.second[(c, c)];
    (0..centred.nrows()).map(|c| if moves(c) { centred[(c, c)].sqrt() } else { 0.0 }).collect()
}

/// Computes the bits per weight that unbalanced columns lose: half of the binary logarithm of the error, as a ratio to
/// the error of balanced columns.
pub(super) fn lost_bits(weights: &[f64], values: &[f64]) -> f64 {
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let balanced = square(weights.iter().zip(values).map(|(a, h)| (a * h).sqrt()).sum());
    0.5 * libm::log2(sum(weights) * sum(values) / balanced.max(f64::MIN_POSITIVE))
}

/// Joins the moments of the elements of a value that matrices read; others are 0.
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

/// Computes the geometric mean; `None` if there are no values.
fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + libm::log(value), count + 1));
    (count > 0).then(|| libm::exp(sum / count as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_of_a_column_cancels_its_scale() {
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
    fn columns_without_weights_or_movement_get_usual_size() {
        let found = units(&[16.0, 0.0, 25.0, 0.0], &[1.0, 8.0, 0.0, 0.0]);
        assert!(found.0.iter().zip([2.0, 0.25, 2.5, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
