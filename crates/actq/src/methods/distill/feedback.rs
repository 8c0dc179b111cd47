//! Two-sided error feedback, then coordinate descent: codes with a small `tr(E H E' G)`. `E` is the matrix's error, `H`
//! the moment of its input, and `G` that of the action error's derivative at its output.
//!
//! With `H = L D L'` and `G = M F M'` (unit lower triangles) the error is `sum_rc F_r D_c (M' E L)_rc^2`. Weights are
//! rounded one by one, in order of falling diagonals. Each weight is the last one in its `(M' E L)_rc`, and makes it as
//! small as its grid allows. So it compensates the earlier errors of its row (through H) and its column (through G).
//! For `G = I` that is GPTQ (arXiv 2210.17323). Sweeps of coordinate descent then change single codes, with all others
//! fixed, and fit the rows' scales to their codes.

use actq_kernels::Width;
use half::bf16;
use nalgebra::DMatrix;

use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{DAMPING_OUTPUT, damped};
use crate::graph::WeightMatrix;
use crate::methods::quantized::Quantized;
use crate::methods::scale::Scales;

/// Sweeps of coordinate descent.
const SWEEPS: usize = 3;

/// A moment as `L D L'` in the order in which rows or columns are rounded.
struct Factor {
    /// Damped moment, row by row, in its own order.
    moment: Vec<f64>,
    /// Rows or columns, the last to be rounded first.
    order: Vec<usize>,
    /// Unit lower triangle by `order`, column by column: entry `(i, j)` at `j * n + i`.
    lower: Vec<f64>,
}

impl Factor {
    /// Factors a moment with a share `damping` of its mean diagonal added to the diagonal.
    fn new(second: &DMatrix<f64>, damping: f64) -> Self {
        let n = second.nrows();
        let (order, ordered) = damped(second, damping);
        let mut moment = vec![0.0; n * n];
        for (i, &a) in order.iter().enumerate() {
            for (j, &b) in order.iter().enumerate() {
                moment[a * n + b] = ordered[(i, j)];
            }
        }
        let mut lower = vec![0.0; n * n];
        if let Some(factor) = ordered.cholesky() {
            let l = factor.l_dirty();
            for j in 0..n {
                for i in j + 1..n {
                    lower[j * n + i] = l[(i, j)] / l[(j, j)];
                }
            }
        }
        Self { moment, order, lower }
    }

    fn len(&self) -> usize {
        self.order.len()
    }

    fn row(&self, r: usize) -> &[f64] {
        &self.moment[r * self.len()..][..self.len()]
    }

    /// Returns the column of the triangle below its diagonal, by position in `order`.
    fn below(&self, j: usize) -> &[f64] {
        &self.lower[j * self.len()..][..self.len()]
    }
}

/// Quantizes `matrix`, whose rows have these widths and `group` columns per scale (0 = no group scales). `input` holds
/// the moments of its input, `damping` the share of the mean that is added to their diagonal; `output` is `G`;
/// `importance` weighs the columns for the first scales.
///
/// The biases take the mean error, so `H` is centred on the input's mean. Returns the matrix and the values to be added
/// to the biases after it.
pub fn feedback(
    matrix: &WeightMatrix,
    widths: &[Option<Width>],
    group: usize,
    importance: &[f64],
    (input, damping): (&Moments, f64),
    output: &DMatrix<f64>,
) -> (Quantized, Vec<f32>) {
    let (h, g) = (Factor::new(&input.centred(), damping), Factor::new(output, DAMPING_OUTPUT));
    let mut rounding = Rounding::new(matrix, widths, Scales::fit(matrix, widths, group, importance));
    rounding.feed_back(&h, &g);
    for _ in 0..SWEEPS {
        for (r, width) in widths.iter().enumerate() {
            if let Some(width) = *width {
                rounding.descend(&h, &g, r, width);
            }
        }
    }
    let Rounding { scales, codes, errors, .. } = rounding;
    let shift = errors.chunks_exact(matrix.cols).map(|e| -dot(e, &input.mean) as f32).collect();
    let (rows, cols, widths) = (matrix.rows, matrix.cols, widths.to_vec());
    (Quantized { rows, cols, group, widths, scales: scales.rows, group_scales: scales.groups, codes }, shift)
}

/// A matrix that is being rounded.
struct Rounding<'a> {
    matrix: &'a WeightMatrix,
    widths: &'a [Option<Width>],
    scales: Scales,
    codes: Vec<u8>,
    /// Rounded minus wanted weights.
    errors: Vec<f64>,
}

impl<'a> Rounding<'a> {
    fn new(matrix: &'a WeightMatrix, widths: &'a [Option<Width>], scales: Scales) -> Self {
        let len = matrix.rows * matrix.cols;
        Self { matrix, widths, scales, codes: vec![0; len], errors: vec![0.0; len] }
    }

    fn value(&self, width: Width, r: usize, c: usize, code: u8) -> f64 {
        f64::from(width.level(code)) * f64::from(self.scales.at(r, c))
    }

    /// Rounds all weights one by one. Each compensates the earlier errors of its row and its column.
    fn feed_back(&mut self, h: &Factor, g: &Factor) {
        let (rows, cols) = (self.matrix.rows, self.matrix.cols);
        let mut carried = vec![0f64; cols];
        let mut done = vec![0f64; cols];
        for i in (0..rows).rev() {
            let r = g.order[i];
            carried.fill(0.0);
            for (&other, m) in g.order.iter().zip(g.below(i)).skip(i + 1) {
                add(&mut carried, *m, &self.errors[other * cols..][..cols]);
            }
            for j in (0..cols).rev() {
                let c = h.order[j];
                let weight = f64::from(self.matrix.data[r * cols + c]);
                let rounded = self.widths[r].map_or(0.0, |width| {
                    let before = dot(&h.below(j)[j + 1..], &done[j + 1..]);
                    let code = self.scales.code(width, r, c, (weight - carried[c] - before) as f32);
                    self.codes[r * cols + c] = code;
                    self.value(width, r, c, code)
                });
                self.errors[r * cols + c] = rounded - weight;
                done[j] = rounded - weight + carried[c];
            }
        }
    }

    /// Changes single codes of a row, with all others fixed, then fits the row's scale to its codes.
    fn descend(&mut self, h: &Factor, g: &Factor, r: usize, width: Width) {
        let cols = self.matrix.cols;
        let mut slopes = self.slopes(h, g, r);
        let own = g.row(r)[r];
        for c in 0..cols {
            let at = r * cols + c;
            let now = self.value(width, r, c, self.codes[at]);
            let code = self.scales.code(width, r, c, (now - slopes[c] / (own * h.row(c)[c])) as f32);
            if code != self.codes[at] {
                let step = self.value(width, r, c, code) - now;
                self.codes[at] = code;
                self.errors[at] += step;
                add(&mut slopes, own * step, h.row(c));
            }
        }
        // The scale at which the derivative along the row's levels vanishes.
        let level =
            |c: usize| f64::from(width.level(self.codes[r * cols + c])) * f64::from(self.scales.group_scale(r, c));
        let levels: Vec<f64> = (0..cols).map(level).collect();
        let slope = dot(&levels, &slopes);
        let curvature: f64 = own * levels.iter().enumerate().map(|(c, l)| l * dot(h.row(c), &levels)).sum::<f64>();
        if curvature > 0.0 {
            let scale = &mut self.scales.rows[r];
            let wanted = bf16::from_f64(scale.to_f64() - slope / curvature);
            if wanted > bf16::ZERO {
                let step = wanted.to_f64() - scale.to_f64();
                add(&mut self.errors[r * cols..][..cols], step, &levels);
                *scale = wanted;
            }
        }
    }

    /// Returns row `r` of `G E H`, half the derivative of the error by the row.
    fn slopes(&self, h: &Factor, g: &Factor, r: usize) -> Vec<f64> {
        let cols = self.matrix.cols;
        let mut weighted = vec![0.0; cols];
        for (other, m) in g.row(r).iter().enumerate() {
            add(&mut weighted, *m, &self.errors[other * cols..][..cols]);
        }
        let mut slopes = vec![0.0; cols];
        for (c, x) in weighted.iter().enumerate() {
            add(&mut slopes, *x, h.row(c));
        }
        slopes
    }
}

/// Computes `to += factor * from`.
fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::sensitivity::DAMPING_INPUT;
    use crate::methods::{gptq, scale};
    use crate::random::Random;

    const ROWS: usize = 24;
    const COLS: usize = 40;

    /// Makes a matrix with the moments of inputs and derivatives that have 8 hidden causes each.
    fn case() -> (WeightMatrix, Moments, DMatrix<f64>) {
        let mut random = Random::new(11);
        let data = (0..ROWS * COLS).map(|_| random.unit()).collect();
        let mut second = |n: usize| {
            let mixing = DMatrix::from_fn(n, 8, |_, _| f64::from(random.unit()));
            let x = mixing * DMatrix::from_fn(8, 400, |_, _| f64::from(random.unit()));
            &x * x.transpose() / 400.0
        };
        let (input, output) = (second(COLS), second(ROWS));
        let matrix = WeightMatrix { name: "w".into(), rows: ROWS, cols: COLS, data };
        (matrix, Moments { second: input, mean: vec![0.0; COLS], count: 400 }, output)
    }

    fn error(matrix: &WeightMatrix, quantized: &Quantized, input: &DMatrix<f64>, output: &DMatrix<f64>) -> f64 {
        let of = |values: &[f32]| DMatrix::from_row_slice(matrix.rows, matrix.cols, values).cast::<f64>();
        let e = of(&quantized.dequantized()) - of(&matrix.data);
        (&e * input * e.transpose() * output).trace()
    }

    #[test]
    fn two_sided_feedback_beats_columns_alone() {
        let (matrix, input, output) = case();
        for width in [Width::W2, Width::W3, Width::W4] {
            let one_sided = gptq::quantize(&matrix, width, 0, &input).expect("positive definite");
            let widths = vec![Some(width); ROWS];
            let (both, shift) = feedback(&matrix, &widths, 0, &[], (&input, DAMPING_INPUT), &output);
            let [plain, one, both] = [&scale::round_to_nearest(&matrix, width, 0), &one_sided, &both]
                .map(|q| error(&matrix, q, &input.second, &output));
            assert!(both < 0.5 * one && one < plain, "{width:?}: {both}, {one}, {plain}");
            assert!(shift.iter().all(|s| *s == 0.0), "the inputs' mean is zero");
        }
    }

    /// Checks unit moments, in which nothing is correlated.
    #[test]
    fn unit_moments_reduce_to_rounding_with_fitted_scales() {
        let (matrix, ..) = case();
        let unit = Moments { second: DMatrix::identity(COLS, COLS), mean: vec![0.0; COLS], count: 1 };
        let (found, _) =
            feedback(&matrix, &[Some(Width::W3); ROWS], 0, &[], (&unit, DAMPING_INPUT), &DMatrix::identity(ROWS, ROWS));
        for (r, row) in matrix.data.chunks_exact(COLS).enumerate() {
            let scale = found.scales[r].to_f32();
            let nearest: Vec<u8> = row.iter().map(|w| Width::W3.nearest_code(w / scale)).collect();
            let moved = nearest.iter().zip(&found.codes[r * COLS..]).filter(|(a, b)| a != b).count();
            // The last fit of the scale may leave a code at the edge of its cell.
            assert!(moved <= 1, "row {r}: {moved} codes are not the nearest");
        }
    }

    #[test]
    fn biases_absorb_the_mean_error_of_removed_rows() {
        let (matrix, mut input, output) = case();
        input.mean = (0..COLS).map(|c| 0.1 * c as f64).collect();
        let mean = nalgebra::DVector::from_column_slice(&input.mean);
        input.second += &mean * mean.transpose();
        let mut widths = vec![Some(Width::W2); ROWS];
        widths[3] = None;
        let (found, shift) = feedback(&matrix, &widths, 0, &[], (&input, DAMPING_INPUT), &output);
        let weights = found.dequantized();
        assert!(weights[3 * COLS..4 * COLS].iter().all(|w| *w == 0.0));
        let rows = matrix.data.chunks_exact(COLS).zip(weights.chunks_exact(COLS)).zip(shift);
        for (r, ((wanted, got), shift)) in rows.enumerate() {
            let errors = wanted.iter().zip(got).map(|(w, q)| f64::from(*w) - f64::from(*q));
            let expected: f64 = errors.zip(&input.mean).map(|(e, m)| e * m).sum();
            assert!((expected - f64::from(shift)).abs() < 1e-3, "row {r}: {expected} and {shift}");
        }
    }
}
