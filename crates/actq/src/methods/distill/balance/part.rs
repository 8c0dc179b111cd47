//! Selection of the columns that an operation scales, with or without subtracting their means.
//!
//! An operation's constants take 8 bytes a value, or 4 without means. In a small policy these bytes are bits of every
//! weight. Columns `O` keep their values. The best factors of the others are relative to the factor that all of `O`
//! would get as one column. The expected error is then proportional to
//!
//! `(sqrt(A H) + sum_c sqrt(a_c h_c))^2` with `A` and `H` the sums of `a_c` and `h_c` over `O`.
//!
//! With every column scaled the error is least, `(sum_c sqrt(a_c h_c))^2`. The search starts with all columns in the
//! order of `a_c / h_c`. It removes one column at a time, from the end that lowers the error more. Each remainder
//! is an `O`. The search selects, with means or without, the `O` whose error and bytes cost the fewest bits.

use std::ops::Range;

use super::columns::Columns;
use crate::graph::ops::Balance;

/// Bytes of an operation's record.
const RECORD_BYTES: usize = 16;
/// Ratio of the error of rounding a column's weights to 3 bits (`allocate.rs`) to that of rounding all inputs to int8,
/// if the column's values are the largest: `0.036 * 12 * 127^2`. The mean adds nothing to the first.
const WEIGHT_TO_INPUT_ERROR: f64 = 7000.0;
/// Minimum additional saving of an operation without means over one with them, in bits per weight of the policy.
/// Learning is easier about the means, and the expected error does not include this.
const MIN_GAIN_WITHOUT_MEANS: f64 = 1.0 / 16.0;
/// Maximum of values and factors without means, and reciprocal of their minimum: 128 of the largest deviations are
/// still below 2^47, the range in which the operation is exact.
const MAX_WITHOUT_MEANS: f64 = (1u64 << 40) as f64;

/// Columns that an operation scales.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    /// Runs of scaled columns, ascending, with a gap between two.
    pub(super) runs: Vec<Range<usize>>,
    /// `true` if the operation subtracts the means.
    pub(super) has_means: bool,
    /// `(A / H)^(1/4)` of the columns in no run; `None` if all are scaled.
    pub(super) kept_factor: Option<f64>,
    /// Loss compared with an operation on all columns and their means, in bits per weight.
    pub(super) lost_bits: f64,
}

impl Part {
    /// Selects all columns and their means.
    pub(super) fn whole(columns: &Columns) -> Self {
        let runs = std::iter::once(0..columns.mean.len()).collect();
        Self { runs, has_means: true, kept_factor: None, lost_bits: 0.0 }
    }

    /// Selects the part that costs the fewest bits, lost and stored. `reading_weights` of the policy's `weights` read
    /// the columns.
    pub(super) fn cheapest(columns: &Columns, reading_weights: usize, weights: usize) -> Self {
        let cost = |part: &Self| {
            let means = if part.has_means { 0.0 } else { MIN_GAIN_WITHOUT_MEANS * weights as f64 };
            reading_weights as f64 * part.lost_bits + 8.0 * part.bytes() as f64 + means
        };
        let whole = Self::whole(columns);
        let is_within =
            |&has_means: &bool| has_means || (0..columns.mean.len()).all(|c| !columns.is_beyond(c, MAX_WITHOUT_MEANS));
        let forms = [true, false].into_iter().filter(is_within);
        let parts = forms.flat_map(|has_means| Kept::of(columns, has_means).parts());
        parts.fold(whole, |cheapest, part| if cost(&part) < cost(&cheapest) { part } else { cheapest })
    }

    /// Iterates over the scaled columns.
    pub(super) fn columns(&self) -> impl Iterator<Item = usize> {
        self.runs.iter().cloned().flatten()
    }

    /// Returns the means that the operation subtracts; 0 for the other columns.
    pub(super) fn means(&self, mean: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; mean.len()];
        self.columns().filter(|_| self.has_means).for_each(|c| means[c] = mean[c]);
        means
    }

    /// Computes `d` of the scaled columns, relative to the others, which get 1. If there are no others, the geometric
    /// mean of the scaled deviations of the values that moved is 1. Returns `None` if nothing moved.
    pub(super) fn factors(&self, columns: &Columns) -> Option<Vec<f64>> {
        let (of_columns, unit) = columns.factors()?;
        let unit = self.kept_factor.unwrap_or(unit);
        let (_, values) = columns.in_value_units();
        let mut factors = vec![1.0; values.len()];
        for c in self.columns() {
            factors[c] = of_columns[c] / unit * self.share(values[c], columns.mean[c]);
        }
        Some(factors)
    }

    /// Computes the share of a factor that remains if the mean is not subtracted.
    fn share(&self, value: f64, mean: f64) -> f64 {
        if self.has_means { 1.0 } else { (value / with_mean(value, mean)).sqrt().sqrt() }
    }

    /// `true` if its operations can hold these factors: without means, f32 holds them times a large power of two.
    pub(super) fn holds(&self, factors: &[f64]) -> bool {
        self.has_means || factors.iter().all(|factor| (MAX_WITHOUT_MEANS.recip()..=MAX_WITHOUT_MEANS).contains(factor))
    }

    /// Counts the bytes of its constants and records. (As for an operation on all columns, one record does not count.)
    pub(super) fn bytes(&self) -> usize {
        let copies = usize::from(self.kept_factor.is_some() || !self.has_means);
        let constant_bytes: usize = self.runs.iter().map(|run| constants_of_run(self.has_means, run.len())).sum();
        constant_bytes + RECORD_BYTES * (self.runs.len() + copies - 1)
    }
}

/// Counts the bytes of the constants for a run of `len` values.
fn constants_of_run(has_means: bool, len: usize) -> usize {
    if has_means { Balance::bytes(len) } else { Balance::bytes_without_means(len) }
}

/// Computes what a column adds to `H` if its mean is not subtracted.
fn with_mean(value: f64, mean: f64) -> f64 {
    value + mean * mean / WEIGHT_TO_INPUT_ERROR
}

/// Contributions of kept and of scaled columns to the error.
struct Kept {
    /// `true` if the means of the scaled columns are subtracted.
    has_means: bool,
    /// Columns that may be kept, in the order of `a_c / h_c`.
    order: Vec<usize>,
    /// `a` of each column.
    weights: Vec<f64>,
    /// `h` of each column, with its mean not subtracted.
    values: Vec<f64>,
    /// `sqrt(a h)` of each column if it is scaled.
    scaled: Vec<f64>,
    /// Sum of `sqrt(a h)` about the means over all columns: the square root of the least error.
    least: f64,
}

impl Kept {
    fn of(columns: &Columns, has_means: bool) -> Self {
        let (weights, centred) = columns.in_value_units();
        let values: Vec<f64> = centred.iter().zip(&columns.mean).map(|(h, mean)| with_mean(*h, *mean)).collect();
        let roots = |values: &[f64]| weights.iter().zip(values).map(|(a, h)| (a * h).sqrt()).collect::<Vec<f64>>();
        let scaled = roots(if has_means { &centred } else { &values });
        let least = roots(&centred).iter().sum();
        let mut order: Vec<usize> = (0..weights.len()).filter(|&c| !columns.is_outlier(c)).collect();
        let ratio = |c: usize| weights[c] / values[c];
        order.sort_by(|&a, &b| ratio(a).total_cmp(&ratio(b)).then(values[b].total_cmp(&values[a])));
        Self { has_means, order, weights, values, scaled, least }
    }

    /// Lists parts that keep fewer and fewer columns.
    fn parts(&self) -> Vec<Part> {
        let mut order = &self.order[..];
        let mut parts = Vec::new();
        while let [others @ .., _] = order {
            parts.extend(self.part(&self.flags(order)));
            let but_first = &order[1..];
            let [first, last] = [but_first, others].map(|kept| self.error(&self.flags(kept)));
            order = if first < last { but_first } else { others };
        }
        if !self.has_means {
            parts.extend(self.part(&self.flags(&[])));
        }
        parts
    }

    /// Returns a flag for each column, `true` if `kept` contains it.
    fn flags(&self, kept: &[usize]) -> Vec<bool> {
        let mut is_kept = vec![false; self.weights.len()];
        kept.iter().for_each(|&c| is_kept[c] = true);
        is_kept
    }

    /// Builds the part whose runs scale the columns that are not kept. Also scales the columns between two runs if this
    /// takes fewer bytes than one more run.
    fn part(&self, is_kept: &[bool]) -> Option<Part> {
        let bytes_of_one_more_run = RECORD_BYTES + constants_of_run(self.has_means, 0);
        let bytes_of_values = |len: usize| constants_of_run(self.has_means, len) - constants_of_run(self.has_means, 0);
        let mut is_kept = is_kept.to_vec();
        let mut runs: Vec<Range<usize>> = Vec::new();
        for c in 0..is_kept.len() {
            if is_kept[c] {
                continue;
            }
            match runs.last_mut() {
                Some(run) if bytes_of_values(c - run.end) < bytes_of_one_more_run => {
                    is_kept[run.end..c].fill(false);
                    run.end = c + 1;
                }
                _ => runs.push(c..c + 1),
            }
        }
        let [weights, values] = self.sums(&is_kept);
        let kept_factor = is_kept.contains(&true).then(|| (weights / values).sqrt().sqrt());
        let lost_bits = libm::log2(self.error(&is_kept) / self.least);
        let fits = kept_factor.map_or(!self.has_means, |factor| factor > 0.0 && factor.is_finite());
        let is_usable = fits && !runs.is_empty() && lost_bits.is_finite();
        is_usable.then_some(Part { runs, has_means: self.has_means, kept_factor, lost_bits })
    }

    /// Sums `a` and `h` over the kept columns, to `A` and `H`.
    fn sums(&self, is_kept: &[bool]) -> [f64; 2] {
        let sum = |values: &[f64]| values.iter().zip(is_kept).filter(|(_, kept)| **kept).map(|(v, _)| v).sum();
        [sum(&self.weights), sum(&self.values)]
    }

    /// Computes the square root of the expected error.
    fn error(&self, is_kept: &[bool]) -> f64 {
        let [weights, values] = self.sums(is_kept);
        let scaled = self.scaled.iter().zip(is_kept).filter(|(_, kept)| !**kept);
        (weights * values).sqrt() + scaled.map(|(root, _)| root).sum::<f64>()
    }
}
