//! The expected error of removing elements of a hidden vector, together.
//!
//! If several elements carry the same information, removing one costs nothing and removing all does. So elements are
//! ranked: the first explains most of the vector's effect, the next most of the rest, and so on. This is column subset
//! selection by a pivoted Cholesky factorization, with the criterion of Optimal Brain Surgeon (Hassibi, Stork 1993) for
//! several weights. Each element's error is its addition to those ranked before it. If the elements down to any rank
//! are kept, the sum over the others is the error of removing them all. Least squares from the kept ones then take
//! their place.
//!
//! A recording has too few frames to estimate all correlations. So an element costs at least its own effect, with
//! compensation half as far (in logarithms) as the recording allows ([`importance`]).

use std::ops::Range;

use nalgebra::DMatrix;
use ndarray::{Array1, Array2, ArrayView1};
use rayon::prelude::*;

use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{DAMPING_INPUT, Side, importance};
use crate::gemm::{Panels, add_product_parallel};
use crate::graph::{Graph, WeightMatrix};
use crate::simd::wide;

/// Rows that a thread takes together.
const ROWS: usize = 64;

/// Matrices that read the same vector, or the same part of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reading {
    /// The matrices.
    pub matrices: Vec<usize>,
    /// Their columns.
    pub columns: Range<usize>,
}

/// A hidden vector and what the network makes of it.
#[derive(Debug)]
pub struct Effect {
    /// Covariance of its elements.
    centred: DMatrix<f64>,
    /// The network's error as a quadratic form of the vector's.
    effect: Array2<f64>,
}

impl Effect {
    /// Measures the vector that is read. `moments` has the moments of every matrix's input, `g` the importance of every
    /// matrix's rows.
    pub fn of(graph: &Graph, Reading { matrices, columns }: &Reading, moments: &[&Moments], g: &[Vec<f64>]) -> Self {
        let (from, n) = (columns.start, columns.len());
        let of_part =
            |all: DMatrix<f64>| if n < all.nrows() { all.view((from, from), (n, n)).into_owned() } else { all };
        let centred = matrices.first().map_or_else(|| DMatrix::zeros(n, n), |&first| of_part(moments[first].centred()));
        let mut effect = Array2::zeros((n, n));
        for &m in matrices {
            let matrix = &graph.matrices[m];
            let weight = |(r, c): (usize, usize)| f64::from(matrix.data[r * matrix.cols + from + c]);
            let w = Array2::from_shape_fn((matrix.rows, n), weight);
            let weighed = Array2::from_shape_fn(w.raw_dim(), |(r, c)| g[m][r] * w[[r, c]]);
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
        together(std::slice::from_ref(self))
    }
}

/// Returns the errors of removing each element, as [`Effect::together`], where several vectors lose the same elements:
/// the sums over the vectors. All have the same length.
pub(super) fn together(effects: &[Effect]) -> Vec<f64> {
    let alone: Vec<Vec<f64>> = effects.iter().map(Effect::alone).collect();
    let at_least = |j: usize| alone.iter().map(|alone| alone[j]).sum::<f64>();
    ranked(effects).into_iter().enumerate().map(|(j, joint)| joint.max(at_least(j))).collect()
}

/// Returns errors of removal in which every hidden vector costs the same, for networks that lose nearly all elements.
/// `removals` are the measured ones; `mean_action_error` is the error of a network that always gives the mean action.
///
/// Measured errors are those of small changes: linear in the elements, and with the other vectors unchanged. Their sum
/// over a vector can be a thirtieth of `mean_action_error`, although the action is lost without the vector. And they
/// hardly fall from rank to rank, so that widths that alternate between few and many elements look cheapest. Here every
/// vector costs `mean_action_error`. An element costs the geometric mean of its measured error and of a law by which
/// `k` elements leave a `k + 1`-th of the error.
pub(super) fn even_layer_errors(removals: &[f64], mean_action_error: f64) -> Vec<f64> {
    let mut ranked: Vec<usize> = (0..removals.len()).collect();
    ranked.sort_by(|&a, &b| removals[b].total_cmp(&removals[a]));
    let mut means = vec![0.0; removals.len()];
    for (rank, &j) in ranked.iter().enumerate() {
        let by_law = 1.0 / ((rank + 1) * (rank + 2)) as f64;
        means[j] = (removals[j] * by_law).sqrt();
    }
    let sum = means.iter().sum::<f64>();
    let factor = if sum > 0.0 { mean_action_error / sum } else { 0.0 };
    means.iter().map(|error| error * factor).collect()
}

/// Returns the errors of the rows of a matrix without bits, if their elements stay: each then always gives its mean,
/// and loses the variance of its product. No other row makes up for that; sums of such elements, as residual ones,
/// would lose what the network adds to them.
pub(super) fn in_place(matrix: &WeightMatrix, moments: &Moments, g: &[f64]) -> Vec<f64> {
    let centred = moments.centred();
    let w = Array2::from_shape_fn((matrix.rows, matrix.cols), |(r, c)| f64::from(matrix.data[r * matrix.cols + c]));
    let covariance = Array2::from_shape_fn(centred.shape(), |(i, j)| centred[(i, j)]);
    let mut through = Array2::zeros(w.raw_dim());
    add_product_parallel(w.view(), &Panels::of(covariance.view()), through.view_mut());
    through.rows().into_iter().zip(w.rows()).zip(g).map(|((a, b), g)| g * dot(&a, &b).max(0.0)).collect()
}

/// Ranks the elements by their effect on the network; returns the errors of their removal.
fn ranked(effects: &[Effect]) -> Vec<f64> {
    let mut vectors: Vec<Unexplained<'_>> = effects.iter().map(Unexplained::of).collect();
    let n = effects.first().map_or(0, |effect| effect.centred.nrows());
    let mut gains: Vec<(usize, f64)> = Vec::with_capacity(n);
    let mut left: Vec<usize> = (0..n).collect();
    while !left.is_empty() {
        let gain = |j: usize| vectors.iter().map(|vector| vector.gain(j)).sum::<f64>();
        let best = (0..left.len()).max_by(|&a, &b| gain(left[a]).total_cmp(&gain(left[b]))).unwrap_or(0);
        let j = left.swap_remove(best);
        gains.push((j, gain(j).max(0.0)));
        vectors.iter_mut().for_each(|vector| vector.explain(j));
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

/// A vector without what the elements that are ranked so far explain.
struct Unexplained<'a> {
    effect: &'a Array2<f64>,
    damping: f64,
    /// Covariance of its elements.
    rest: Array2<f64>,
    /// The part of the effect that each would explain, times its variance.
    explained: Array1<f64>,
}

impl<'a> Unexplained<'a> {
    fn of(Effect { centred, effect }: &'a Effect) -> Self {
        let n = centred.nrows();
        let damping = (DAMPING_INPUT * centred.trace() / n.max(1) as f64).max(1e-30);
        let rest = Array2::from_shape_fn((n, n), |(i, j)| centred[(i, j)] + if i == j { damping } else { 0.0 });
        let mut explained = Array1::zeros(n);
        let mut through = Array2::zeros((n, n));
        add_product_parallel(rest.view(), &Panels::of(effect.view()), through.view_mut());
        explained.iter_mut().zip(through.rows()).zip(rest.rows()).for_each(|((e, a), b)| *e = dot(&a, &b));
        Self { effect, damping, rest, explained }
    }

    fn variance(&self, j: usize) -> f64 {
        self.rest[[j, j]].max(self.damping * 1e-3)
    }

    /// Returns the part of the effect that element `j` explains.
    fn gain(&self, j: usize) -> f64 {
        self.explained[j] / self.variance(j)
    }

    /// Subtracts what element `j` explains.
    fn explain(&mut self, j: usize) {
        let root = self.variance(j).sqrt();
        let v = self.rest.column(j).mapv(|value| value / root);
        let w = times(self.effect, &v);
        let u = times(&self.rest, &w);
        let along = dot(&v.view(), &w.view());
        for ((e, v), u) in self.explained.iter_mut().zip(&v).zip(&u) {
            *e += v * (v * along - 2.0 * u);
        }
        let n = v.len();
        let v = v.as_slice().unwrap_or_default();
        let rows = self.rest.as_slice_mut().unwrap_or_default().par_chunks_mut(n).zip(v);
        rows.with_min_len(ROWS).for_each(|(row, of_row)| {
            wide(
                #[inline(always)]
                || row.iter_mut().zip(v).for_each(|(rest, v)| *rest -= of_row * v),
            );
        });
    }
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
    fn copies_are_free_alone_and_not_together() {
        // Elements 0 to 3 are one value, element 4 another one with half the effect.
        let of = |i: usize| usize::from(i == 4);
        let second = DMatrix::from_fn(5, 5, |i, j| if of(i) == of(j) { 1.0 } else { 0.0 });
        let effect = Array2::from_shape_fn((5, 5), |(i, j)| match (of(i), of(j)) {
            (0, 0) => 1.0 / 16.0,
            (1, 1) => 0.5,
            _ => 0.0,
        });
        let mut removals = ranked(&[Effect { centred: second, effect }]);
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
        let square = w.tr_mul(&w);
        let effect = || Array2::from_shape_fn((N, N), |(i, j)| square[(i, j)]);
        let of_one = Effect { centred: second.clone(), effect: effect() };
        let removals = ranked(std::slice::from_ref(&of_one));
        // Two vectors that lose the same elements lose twice as much.
        let of_two = [of_one, Effect { centred: second.clone(), effect: effect() }];
        ranked(&of_two).iter().zip(&removals).for_each(|(two, one)| assert!((two / one - 2.0).abs() < 1e-9));
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

    #[test]
    fn even_layer_errors_keep_order_and_sum() {
        let measured = [0.03, 0.0, 0.02, 0.05, 0.02];
        let even = even_layer_errors(&measured, 12.0);
        assert!((even.iter().sum::<f64>() - 12.0).abs() < 1e-9, "{even:?}");
        for (a, b) in (0..measured.len()).flat_map(|a| (0..measured.len()).map(move |b| (a, b))) {
            assert!(measured[a] <= measured[b] || even[a] > even[b], "{even:?}");
        }
        // The first of equal elements costs sqrt(3) times as much as the second.
        let of_equal = even_layer_errors(&[0.1; 2], 1.0);
        assert!((of_equal[0] / of_equal[1] - 3f64.sqrt()).abs() < 1e-9, "{of_equal:?}");
        assert_eq!(even_layer_errors(&[0.0; 3], 12.0), [0.0; 3]);
    }

    #[test]
    fn a_row_that_stays_loses_its_variance() {
        // Columns 0 and 1 are equal: the rows add and subtract them.
        let second = DMatrix::from_fn(3, 3, |i, j| if i == j || i + j == 1 { 2.0 } else { 0.0 });
        let moments = Moments { second, mean: vec![1.0, 1.0, 0.0], count: 1 };
        let data = vec![1.0, 1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 3.0];
        let matrix = WeightMatrix { name: "m".into(), rows: 3, cols: 3, data };
        assert_eq!(in_place(&matrix, &moments, &[1.0, 1.0, 0.5]), [4.0, 0.0, 9.0]);
    }
}
