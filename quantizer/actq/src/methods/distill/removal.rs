//! The expected error of removing elements of a hidden vector, together.
//!
//! An element that others repeat costs nothing to remove, but not all that repeat each other. So elements are ranked:
//! the first explains most of the vector's effect, the next most of the rest, and so on (column subset selection by a
//! pivoted Cholesky factorization; the criterion is that of Optimal Brain Surgeon, Hassibi, Stork 1993, for several
//! weights). Each element's error is what it adds to those ranked before it. Whatever is kept down to a rank, the sum
//! over the removed elements is the error of removing all of them, with least squares from the kept ones in their place.
//!
//! A recording has few frames for so many correlations. So an element costs at least its own effect, with compensation
//! half as far (in logarithms) as the recording allows ([`importance`]).

use nalgebra::DMatrix;
use ndarray::{Array1, Array2, ArrayView1};
use rayon::prelude::*;

use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{DAMPING_INPUT, Side, importance};
use crate::gemm::{Panels, add_product_parallel};
use crate::graph::Graph;
use crate::simd::wide;

/// Rows that a thread takes together.
const ROWS: usize = 64;

/// A hidden vector and what the network makes of it.
#[derive(Debug)]
pub struct Effect {
    /// Covariance of its elements.
    centred: DMatrix<f64>,
    /// The network's error as a quadratic form of the vector's.
    effect: Array2<f64>,
}

impl Effect {
    /// Measures the vector that the matrices `consumers` read. `moments` has the moments of every matrix's input, `g` the
    /// importance of every matrix's rows.
    pub fn of(graph: &Graph, consumers: &[usize], moments: &[&Moments], g: &[Vec<f64>]) -> Self {
        let centred = consumers.first().map_or_else(|| DMatrix::zeros(0, 0), |&first| moments[first].centred());
        let n = centred.nrows();
        let mut effect = Array2::zeros((n, n));
        for &consumer in consumers {
            let matrix = &graph.matrices[consumer];
            let w = Array2::from_shape_fn((matrix.rows, n), |(r, c)| f64::from(matrix.data[r * n + c]));
            let weighed = Array2::from_shape_fn(w.raw_dim(), |(r, c)| g[consumer][r] * w[[r, c]]);
            add_product_parallel(weighed.t(), &Panels::of(w.view()), effect.view_mut());
        }
        Self { centred, effect }
    }

    /// Returns the errors of removing each element alone, with compensation half as far (in logarithms) as the
    /// recording allows.
    pub fn alone(&self) -> Vec<f64> {
        let importance = importance(&self.centred, Side::Input);
        importance.into_iter().enumerate().map(|(j, h)| h * self.effect[[j, j]]).collect()
    }

    /// Returns the errors of removing each element together with those that matter less, at least as much as alone.
    /// The work grows with the cube of the vector's length.
    pub fn together(&self) -> Vec<f64> {
        let joint = ranked(&self.centred, &self.effect);
        joint.into_iter().zip(self.alone()).map(|(joint, alone)| joint.max(alone)).collect()
    }
}

/// Ranks the elements of a vector with the covariance `second` by their effect, a quadratic form; returns the errors of
/// their removal.
fn ranked(second: &DMatrix<f64>, effect: &Array2<f64>) -> Vec<f64> {
    let n = second.nrows();
    let damping = (DAMPING_INPUT * second.trace() / n.max(1) as f64).max(1e-30);
    // The covariance that the elements so far do not explain.
    let mut rest = Array2::from_shape_fn((n, n), |(i, j)| second[(i, j)] + if i == j { damping } else { 0.0 });
    let mut explained = Array1::zeros(n);
    let mut through = Array2::zeros((n, n));
    add_product_parallel(rest.view(), &Panels::of(effect.view()), through.view_mut());
    explained.iter_mut().zip(through.rows()).zip(rest.rows()).for_each(|((e, a), b)| *e = dot(&a, &b));
    let mut gains: Vec<(usize, f64)> = Vec::with_capacity(n);
    let mut left: Vec<usize> = (0..n).collect();
    while !left.is_empty() {
        let gain = |j: usize| explained[j] / rest[[j, j]].max(damping * 1e-3);
        let best = (0..left.len()).max_by(|&a, &b| gain(left[a]).total_cmp(&gain(left[b]))).unwrap_or(0);
        let j = left.swap_remove(best);
        gains.push((j, gain(j).max(0.0)));
        let root = rest[[j, j]].max(damping * 1e-3).sqrt();
        let v = rest.column(j).mapv(|value| value / root);
        let w = times(effect, &v);
        let u = times(&rest, &w);
        let along = dot(&v.view(), &w.view());
        for ((e, v), u) in explained.iter_mut().zip(&v).zip(&u) {
            *e += v * (v * along - 2.0 * u);
        }
        let v = v.as_slice().unwrap_or_default();
        let rows = rest.as_slice_mut().unwrap_or_default().par_chunks_mut(n).zip(v);
        rows.with_min_len(ROWS).for_each(|(row, of_row)| {
            wide(
                #[inline(always)]
                || row.iter_mut().zip(v).for_each(|(rest, v)| *rest -= of_row * v),
            );
        });
    }
    // An element that suits those before it better than its rank says costs as much as the next ones.
    let mut removals = vec![0.0; n];
    let mut most = 0f64;
    for (j, gain) in gains.into_iter().rev() {
        most = most.max(gain);
        removals[j] = most;
    }
    removals
}

fn times(matrix: &Array2<f64>, v: &Array1<f64>) -> Array1<f64> {
    let rows = matrix.as_slice().unwrap_or_default().par_chunks(v.len().max(1)).with_min_len(ROWS);
    rows.map(|row| dot(&ArrayView1::from(row), &v.view())).collect::<Vec<f64>>().into()
}

/// Returns the sum of products, in an order that does not depend on the processor.
fn dot(a: &ArrayView1<'_, f64>, b: &ArrayView1<'_, f64>) -> f64 {
    const LANES: usize = 8;
    let (a, b) = (a.as_slice().unwrap_or_default(), b.as_slice().unwrap_or_default());
    wide(
        #[inline(always)]
        || {
            let mut sums = [0.0; LANES];
            for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
                sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
            }
            sums.iter().sum()
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn copies_are_free_one_by_one_and_not_together() {
        // Elements 0 to 3 are one value, element 4 another one with half the effect.
        let of = |i: usize| usize::from(i == 4);
        let second = DMatrix::from_fn(5, 5, |i, j| if of(i) == of(j) { 1.0 } else { 0.0 });
        let effect = Array2::from_shape_fn((5, 5), |(i, j)| match (of(i), of(j)) {
            (0, 0) => 1.0 / 16.0,
            (1, 1) => 0.5,
            _ => 0.0,
        });
        let mut removals = ranked(&second, &effect);
        assert!((removals[4] - 0.5).abs() < 0.05, "{removals:?}");
        removals.truncate(4);
        removals.sort_by(f64::total_cmp);
        assert!(removals[2] < 0.05 && (removals[3] - 1.0).abs() < 0.1, "{removals:?}");
    }

    /// The sum over removed elements is the error that least squares leaves.
    #[test]
    fn errors_add_up_to_that_of_all_removed() {
        const N: usize = 12;
        let mut random = Random::new(3);
        let mixing = DMatrix::from_fn(N, N, |_, _| f64::from(random.normal()));
        let second = &mixing * mixing.transpose();
        let w = DMatrix::from_fn(4, N, |_, _| f64::from(random.normal()));
        let effect = w.tr_mul(&w);
        let effect = Array2::from_shape_fn((N, N), |(i, j)| effect[(i, j)]);
        let removals = ranked(&second, &effect);
        let mut order: Vec<usize> = (0..N).collect();
        order.sort_by(|&a, &b| removals[b].total_cmp(&removals[a]));
        let damping = DAMPING_INPUT * second.trace() / N as f64;
        let damped = &second + DMatrix::identity(N, N) * damping;
        for kept in [1, 3, 6] {
            let (kept, gone) = order.split_at(kept);
            let part = |a: &[usize], b: &[usize]| damped.select_rows(a).select_columns(b);
            let among = part(kept, kept).cholesky().expect("positive definite");
            let left = part(gone, gone) - part(gone, kept) * among.solve(&part(kept, gone));
            let of_gone = w.select_columns(gone);
            let error = (&of_gone * left * of_gone.transpose()).trace();
            let sum: f64 = gone.iter().map(|&j| removals[j]).sum();
            assert!((sum / error - 1.0).abs() < 0.25, "{sum} against {error}");
        }
    }
}
