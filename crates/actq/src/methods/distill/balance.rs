//! Balances columns: scales the values that matrices read, so that no column's weights or values dominate: those of the
//! observation, and hidden ones whose units a function such as tanh fixes.
//!
//! Users choose the units of observations. A row has one scale, so rounding errors of its weights have the same size in
//! every column. In a column of small weights, a weight is rounded to zero or to much more than its value. In a column
//! of large values, the values multiply the rounding error. Activations have one scale a vector, with the same
//! consequence if weights and values change places. Multiply the values that column `c` reads by a factor `d_c`, and
//! its weights by the reciprocal. The network then computes the same function. The expected error of the matrices that
//! follow is proportional to
//!
//! `sum_c a_c / d_c^2 * sum_c h_c d_c^2` with `a_c = sum_r g_r w_rc^2`.
//!
//! `h` and `g` are the importance of columns and rows, and each column has its own unit (`columns.rs`). The error is
//! least, `(sum_c sqrt(a_c h_c))^2` by Cauchy and Schwarz, for `d_c = (a_c / h_c)^(1/4)`. SmoothQuant (arXiv
//! 2211.10438, eq. 4) with alpha 1/2 uses the same formula for the maxima of activations and weights. Biases absorb the
//! values' means.
//!
//! If only matrices read a normalization without an output limit, its own constants absorb factors and means at no
//! cost. Otherwise an operation [`Balance`] holds them, and its bytes count. It scales the columns that need it
//! (`part.rs`). It is added if it saves more bits than it costs. An error reduced to a share `s` saves `log2(1 / s) /
//! 2` bits for each weight of the matrices that follow. Matrices that read the observation beside a hidden vector read
//! it through the same operation (`sites.rs`). [`mixed_units`] reports the other matrices if their units are far apart.

mod columns;
mod mixed;
mod part;
mod sites;
#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};

use super::compact::add_to_bias;
use crate::calibrate::moments::Moments;
use crate::error::Result;
use crate::graph::ops::{Balance, Normalize};
use crate::graph::{Graph, NodeKind};
use columns::{Columns, deviations, lost_bits};
pub use mixed::{MixedUnits, mixed_units};
use part::Part;
use sites::{Reading, Site, sites};

/// Minimum saving of an added operation, in bits per weight of the whole policy: 1.4% of the error.
const MIN_SAVED_BITS: f64 = 0.01;
/// Minimum loss at which units ruin the result of the matrices that read them, in bits per weight of these matrices. It
/// applies however small their share of the policy is.
const RUINOUS_BITS: f64 = 1.0;
/// Maximum saving, in bits per weight: a weight has no more bits to save.
const MAX_SAVED_BITS: f64 = 8.0;

/// Balances the columns of a network. Changes `moments`, those of the matrices' inputs, to those of the balanced
/// network. `outputs` is the importance of the matrices' rows.
///
/// # Errors
///
/// Returns no error for a network that its builder accepted.
pub fn balance(graph: &Graph, moments: &mut [Moments], outputs: &[Vec<f64>]) -> Result<Graph> {
    let mut balanced = graph.clone();
    // In reverse order: an inserted node moves only the nodes that follow it, the readers of earlier values too.
    let mut inserted: Vec<usize> = Vec::new();
    for site in sites(graph).into_iter().rev() {
        let columns = Columns::of(graph, &site, moments, outputs);
        let can_fold = can_fold(graph, &site);
        let part = if can_fold { Part::whole(&columns) } else { choose_part(graph, &site, &columns, moments) };
        if !can_fold && !is_worthwhile(graph, &site, &columns, &part, moments) {
            continue;
        }
        let Some(factors) = part.factors(&columns) else { continue };
        let mean = part.means(&columns.mean);
        for reading in &site.readings {
            let (m, mean, factors) = (reading.matrix, reading.spread(&mean, 0.0), reading.spread(&factors, 1.0));
            let shift = scale(&mut balanced, m, &mean, &factors);
            add_to_bias(&mut balanced, m, &shift);
            moments[m].balance(&mean, &factors);
        }
        if can_fold {
            if let NodeKind::Normalize(normalize) = &mut balanced.nodes[site.value - 1].kind {
                fold(normalize, &mean, &factors);
            }
        } else {
            let [mean, scale]: [Vec<f32>; 2] = [&mean, &factors].map(|of| of.iter().map(|v| *v as f32).collect());
            let balance = Balance::of_runs(part.has_means.then_some(mean), scale, part.runs);
            let moved = |n: &usize| n + inserted.iter().filter(|value| n >= value).count();
            balanced.insert(balance, site.value, &site.readers.iter().map(moved).collect::<Vec<_>>())?;
            inserted.push(site.value);
        }
    }
    Ok(balanced)
}

/// Counts the constant bytes of the operations that [`balance`] added to a network.
pub fn balance_bytes(graph: &Graph) -> usize {
    let bytes = |kind: &NodeKind| if let NodeKind::Balance(balance) = kind { balance.constant_bytes() } else { 0 };
    graph.nodes.iter().map(|node| bytes(&node.kind)).sum()
}

/// Chooses the columns that an operation scales: the part that saves most, or all columns if that part would not keep
/// the policy usable.
fn choose_part(graph: &Graph, site: &Site, columns: &Columns, moments: &[Moments]) -> Part {
    let part = Part::cheapest(columns, count_reading_weights(graph, site), graph.weights());
    let keeps_usable = |factors: Vec<f64>| part.holds(&factors) && !is_ruined(graph, site, moments, &factors);
    let is_usable = !columns.has_outliers() && part.factors(columns).is_some_and(keeps_usable);
    if is_usable { part } else { Part::whole(columns) }
}

/// `true` if an operation saves more than its bytes cost, or if only the operation keeps the policy usable. If units do
/// not ruin the policy, an operation on all columns has to save enough: a few columns always gain a little.
fn is_worthwhile(graph: &Graph, site: &Site, columns: &Columns, part: &Part, moments: &[Moments]) -> bool {
    let saved = |part: &Part| saved_bits(graph, site, columns, part);
    let unit_factors = vec![1.0; columns.mean.len()];
    saved(&Part::whole(columns)) >= MIN_SAVED_BITS * graph.weights() as f64
        || (columns.saved_bits() >= RUINOUS_BITS && saved(part) >= 0.0)
        || columns.has_outliers()
        || is_ruined(graph, site, moments, &unit_factors)
}

/// Computes the bits that an operation saves, minus the bits of its own bytes.
fn saved_bits(graph: &Graph, site: &Site, columns: &Columns, part: &Part) -> f64 {
    let bits = columns.saved_bits().min(MAX_SAVED_BITS) - part.lost_bits;
    count_reading_weights(graph, site) as f64 * bits - 8.0 * part.bytes() as f64
}

/// Counts the weights that read the value.
fn count_reading_weights(graph: &Graph, site: &Site) -> usize {
    site.readings.iter().map(|reading| graph.matrices[reading.matrix].rows * reading.columns().count()).sum()
}

/// `true` if the unit that all elements of this value share ruins a matrix that also reads another value, after these
/// factors are applied. Beside the observation, a hidden value has the unit of the training: the observation's differs.
fn is_ruined(graph: &Graph, site: &Site, moments: &[Moments], factors: &[f64]) -> bool {
    let is_ruined = |reading: &Reading| {
        let squares: Vec<f64> = reading.spread(factors, 1.0).into_iter().map(|d| d * d).collect();
        let deviations = deviations(&moments[reading.matrix]);
        let values: Vec<f64> = deviations.into_iter().zip(&squares).map(|(d, square)| d * d * square).collect();
        let energies = graph.matrices[reading.matrix].column_energies();
        let energies: Vec<f64> = energies.into_iter().zip(&squares).map(|(energy, square)| energy / square).collect();
        reading.is_partial() && lost_bits(&energies, &values) >= RUINOUS_BITS
    };
    site.is_observed && site.readings.iter().any(is_ruined)
}

/// `true` if the value is the output of a normalization without an output limit, and only the site's readers read it.
fn can_fold(graph: &Graph, site: &Site) -> bool {
    let node = site.value.checked_sub(1).map(|n| &graph.nodes[n].kind);
    matches!(node, Some(NodeKind::Normalize(normalize)) if normalize.clip == f32::INFINITY)
        && site.value != graph.output()
        && graph.readers(site.value) == site.readers
}

/// Divides a matrix's columns by the factors, and returns the product of the original matrix and the mean.
fn scale(graph: &mut Graph, matrix: usize, mean: &[f64], factors: &[f64]) -> Vec<f32> {
    let matrix = &mut graph.matrices[matrix];
    let rows = matrix.data.chunks_exact_mut(matrix.cols);
    rows.map(|row| {
        let of_mean: f64 = row.iter().zip(mean).map(|(w, mean)| f64::from(*w) * mean).sum();
        row.iter_mut().zip(factors).for_each(|(w, d)| *w = (f64::from(*w) / d) as f32);
        of_mean as f32
    })
    .collect()
}

/// Folds `((x - mean) * scale - m) * d` into one normalization.
fn fold(normalize: &mut Normalize, mean: &[f64], factors: &[f64]) {
    let Normalize { mean: own, scale, .. } = normalize;
    for ((own, scale), (m, d)) in own.iter_mut().zip(scale).zip(mean.iter().zip(factors)) {
        // If the scale is 0, `m` is 0, too.
        if *scale != 0.0 {
            *own = (f64::from(*own) + m / f64::from(*scale)) as f32;
        }
        *scale = (f64::from(*scale) * d) as f32;
    }
}

impl Moments {
    /// Changes these moments to those of `(x - mean) * factors`.
    fn balance(&mut self, mean: &[f64], factors: &[f64]) {
        let centred = self.centred();
        self.mean.iter_mut().zip(mean).zip(factors).for_each(|((own, mean), d)| *own = (*own - mean) * d);
        let factors = DMatrix::from_diagonal(&DVector::from_column_slice(factors));
        let own = DVector::from_column_slice(&self.mean);
        self.second = &factors * centred * &factors + &own * own.transpose();
    }
}
