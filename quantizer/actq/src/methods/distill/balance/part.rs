//! Which columns an operation scales, and whether it also takes off their means.
//!
//! An operation's constants take 8 bytes a value, or 4 without means, and in a small policy these are bits of every
//! weight. Columns `O` keep their values; for the others the best factors are those relative to what all of `O` would
//! get as one column. The expected error is then proportional to
//!
//! `(sqrt(A H) + sum_c sqrt(a_c h_c))^2` with `A` and `H` the sums of `a_c` and `h_c` over `O`,
//!
//! and with every column scaled it is the least, `(sum_c sqrt(a_c h_c))^2`. In the order of `a_c / h_c`, `O` is what is
//! left when columns are taken from either end, each time from the end that lowers the error more. Of all these `O`,
//! with means and without, the one counts whose error and bytes together cost the fewest bits.

use std::ops::Range;

use super::columns::Columns;
use crate::graph::ops::Balance;

/// Bytes of an operation's record.
const RECORD: usize = 16;
/// The rounding of a column's weights to 3 bits (`allocate.rs`) weighs so many times what rounding all inputs to int8
/// does, where the column's values are the largest: `0.036 * 12 * 127^2`. The mean adds nothing to the first.
const MEANS: f64 = 7000.0;
/// Bits of each weight of the policy that an operation without means has to save beyond one with them: learning is
/// easier about the means, which the expected error does not say.
const WORTH_OF_MEANS: f64 = 1.0 / 16.0;
/// Without means, values and factors are at most so large, and at least one over it: 128 of the largest deviations still
/// are below 2^47, where the operation is exact.
const MOST: f64 = (1u64 << 40) as f64;

/// What an operation scales.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    /// Ascending, with a gap between two.
    pub(super) runs: Vec<Range<usize>>,
    /// Whether it takes the means off.
    pub(super) has_means: bool,
    /// `(A / H)^(1/4)` of the columns in no run; `None` where all are scaled.
    pub(super) kept_factor: Option<f64>,
    /// Bits of each weight that it saves less than an operation on all columns and their means.
    pub(super) lost_bits: f64,
}

impl Part {
    /// All columns and their means.
    pub(super) fn whole(columns: &Columns) -> Self {
        let runs = std::iter::once(0..columns.mean.len()).collect();
        Self { runs, has_means: true, kept_factor: None, lost_bits: 0.0 }
    }

    /// What costs the fewest bits, lost and stored, where so many weights of the policy's read the columns.
    pub(super) fn best(columns: &Columns, readers: usize, weights: usize) -> Self {
        let cost = |part: &Self| {
            let means = if part.has_means { 0.0 } else { WORTH_OF_MEANS * weights as f64 };
            readers as f64 * part.lost_bits + 8.0 * part.bytes() as f64 + means
        };
        let whole = Self::whole(columns);
        let is_within = |&has_means: &bool| has_means || (0..columns.mean.len()).all(|c| !columns.is_beyond(c, MOST));
        let forms = [true, false].into_iter().filter(is_within);
        let parts = forms.flat_map(|has_means| Kept::of(columns, has_means).parts());
        parts.fold(whole, |best, part| if cost(&part) < cost(&best) { part } else { best })
    }

    /// The columns that it scales.
    pub(super) fn columns(&self) -> impl Iterator<Item = usize> {
        self.runs.iter().cloned().flatten()
    }

    /// The means that it takes off, of these.
    pub(super) fn means(&self, mean: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; mean.len()];
        self.columns().filter(|_| self.has_means).for_each(|c| means[c] = mean[c]);
        means
    }

    /// `d` of its columns, 1 of the others: relative to those, or, where there are none, so that the deviations of what
    /// moved are 1 in the geometric mean. `None` where nothing moved.
    pub(super) fn factors(&self, columns: &Columns) -> Option<Vec<f64>> {
        let (of_columns, unit) = columns.factors()?;
        let unit = self.kept_factor.unwrap_or(unit);
        let (_, values) = columns.as_they_are();
        let mut factors = vec![1.0; values.len()];
        for c in self.columns() {
            factors[c] = of_columns[c] / unit * self.share(values[c], columns.mean[c]);
        }
        Some(factors)
    }

    /// The share of a factor that is left where the mean stays.
    fn share(&self, value: f64, mean: f64) -> f64 {
        if self.has_means { 1.0 } else { (value / with_mean(value, mean)).powf(0.25) }
    }

    /// Whether its operations hold these factors: without means, f32 holds them times a large power of two.
    pub(super) fn takes(&self, factors: &[f64]) -> bool {
        self.has_means || factors.iter().all(|factor| (MOST.recip()..=MOST).contains(factor))
    }

    /// Bytes of its constants and records. (As of an operation on all columns, one record does not count.)
    pub(super) fn bytes(&self) -> usize {
        let copies = usize::from(self.kept_factor.is_some() || !self.has_means);
        let constants: usize = self.runs.iter().map(|run| constants(self.has_means, run.len())).sum();
        constants + RECORD * (self.runs.len() + copies - 1)
    }
}

/// Bytes of the constants for a run of so many values.
fn constants(has_means: bool, len: usize) -> usize {
    if has_means { Balance::bytes(len) } else { Balance::bytes_without_means(len) }
}

/// What a column adds to `H` where its mean stays.
fn with_mean(value: f64, mean: f64) -> f64 {
    value + mean * mean / MEANS
}

/// What columns that are kept or scaled add to the error.
struct Kept {
    /// Whether the others' means are taken off.
    has_means: bool,
    /// Columns that may be kept, in the order of `a_c / h_c`.
    order: Vec<usize>,
    /// `a`
    weights: Vec<f64>,
    /// `h`, with the mean that stays.
    values: Vec<f64>,
    /// `sqrt(a h)` of scaled columns.
    scaled: Vec<f64>,
    /// The sum of these about the means.
    least: f64,
}

impl Kept {
    fn of(columns: &Columns, has_means: bool) -> Self {
        let (weights, centred) = columns.as_they_are();
        let values: Vec<f64> = centred.iter().zip(&columns.mean).map(|(h, mean)| with_mean(*h, *mean)).collect();
        let roots = |values: &[f64]| weights.iter().zip(values).map(|(a, h)| (a * h).sqrt()).collect::<Vec<f64>>();
        let scaled = roots(if has_means { &centred } else { &values });
        let least = roots(&centred).iter().sum();
        let mut order: Vec<usize> = (0..weights.len()).filter(|&c| !columns.is_far(c)).collect();
        let ratio = |c: usize| weights[c] / values[c];
        order.sort_by(|&a, &b| ratio(a).total_cmp(&ratio(b)).then(values[b].total_cmp(&values[a])));
        Self { has_means, order, weights, values, scaled, least }
    }

    /// Parts that keep fewer and fewer columns.
    fn parts(&self) -> Vec<Part> {
        let mut order = &self.order[..];
        let mut parts = Vec::new();
        while let [others @ .., _] = order {
            parts.extend(self.part(&self.only(order)));
            let but_first = &order[1..];
            let [first, last] = [but_first, others].map(|kept| self.error(&self.only(kept)));
            order = if first < last { but_first } else { others };
        }
        if !self.has_means {
            parts.extend(self.part(&self.only(&[])));
        }
        parts
    }

    /// Whether each column is kept, of those in `kept`.
    fn only(&self, kept: &[usize]) -> Vec<bool> {
        let mut is_kept = vec![false; self.weights.len()];
        kept.iter().for_each(|&c| is_kept[c] = true);
        is_kept
    }

    /// With the columns in runs that are not kept, and those between two runs that take fewer bytes than one more run.
    fn part(&self, is_kept: &[bool]) -> Option<Part> {
        let of_run = RECORD + constants(self.has_means, 0);
        let of_values = |len: usize| constants(self.has_means, len) - constants(self.has_means, 0);
        let mut is_kept = is_kept.to_vec();
        let mut runs: Vec<Range<usize>> = Vec::new();
        for c in 0..is_kept.len() {
            if is_kept[c] {
                continue;
            }
            match runs.last_mut() {
                Some(run) if of_values(c - run.end) < of_run => {
                    is_kept[run.end..c].fill(false);
                    run.end = c + 1;
                }
                _ => runs.push(c..c + 1),
            }
        }
        let [weights, values] = self.sums(&is_kept);
        let kept_factor = is_kept.contains(&true).then(|| (weights / values).powf(0.25));
        let lost_bits = (self.error(&is_kept) / self.least).log2();
        let fits = kept_factor.map_or(!self.has_means, |factor| factor > 0.0 && factor.is_finite());
        let usable = fits && !runs.is_empty() && lost_bits.is_finite();
        usable.then_some(Part { runs, has_means: self.has_means, kept_factor, lost_bits })
    }

    /// `A` and `H`
    fn sums(&self, is_kept: &[bool]) -> [f64; 2] {
        let sum = |values: &[f64]| values.iter().zip(is_kept).filter(|(_, kept)| **kept).map(|(v, _)| v).sum();
        [sum(&self.weights), sum(&self.values)]
    }

    /// The square root of the expected error.
    fn error(&self, is_kept: &[bool]) -> f64 {
        let [weights, values] = self.sums(is_kept);
        let scaled = self.scaled.iter().zip(is_kept).filter(|(_, kept)| !**kept);
        (weights * values).sqrt() + scaled.map(|(root, _)| root).sum::<f64>()
    }
}
