//! GPTQ (Frantar et al., arXiv 2210.17323, algorithm 1): columns are quantized one after the other. Each column's error
//! is spread over the remaining columns so that the output changes least.

use actq_kernels::layout::Width;
use nalgebra::DMatrix;

use super::quantized::Quantized;
use super::scale::Scales;
use crate::calibrate::moments::Moments;
use crate::error::{Context, Result};
use crate::graph::WeightMatrix;

/// Damping (the paper's dampening): share of the mean diagonal that is added to the diagonal of H.
const DAMPING: f64 = 0.01;

/// Quantizes `matrix` with the second moment `E[x x']` of its input. Columns go in order of falling diagonal
/// ("act-order"). Scales are fitted before, weighted by the diagonal.
pub fn quantize(matrix: &WeightMatrix, width: Width, group: usize, moments: &Moments) -> Result<Quantized> {
    let (rows, cols) = (matrix.rows, matrix.cols);
    let diagonal: Vec<f64> = moments.second.diagonal().iter().copied().collect();
    let scales = Scales::fit(matrix, &vec![Some(width); matrix.rows], group, &diagonal);
    let mut order: Vec<usize> = (0..cols).collect();
    order.sort_by(|&a, &b| diagonal[b].total_cmp(&diagonal[a]));
    let feedback = feedback(&moments.second, &order).with_context(|| format!("tensor {:?}", matrix.name))?;
    let mut codes = vec![0u8; rows * cols];
    let mut left = vec![0f64; cols];
    for row in 0..rows {
        for (left, &col) in left.iter_mut().zip(&order) {
            *left = f64::from(matrix.data[row * cols + col]);
        }
        for (i, &col) in order.iter().enumerate() {
            let code = scales.code(width, row, col, left[i] as f32);
            codes[row * cols + col] = code;
            let value = f64::from(width.level(code)) * f64::from(scales.at(row, col));
            let error = (left[i] - value) / feedback[(i, i)];
            // Column i of the lower factor is row i of GPTQ's upper one.
            for (j, left) in left.iter_mut().enumerate().skip(i + 1) {
                *left -= error * feedback[(j, i)];
            }
        }
    }
    Ok(Quantized {
        rows,
        cols,
        group,
        widths: vec![Some(width); rows],
        scales: scales.rows,
        group_scales: scales.groups,
        codes,
    })
}

/// Returns the lower Cholesky factor of the inverse of the damped moment, with rows and columns in `order`.
fn feedback(second: &DMatrix<f64>, order: &[usize]) -> Result<DMatrix<f64>> {
    let n = order.len();
    let damping = (DAMPING * second.trace() / n as f64).max(1e-12);
    let damped = DMatrix::from_fn(n, n, |i, j| second[(order[i], order[j])] + if i == j { damping } else { 0.0 });
    let inverse = damped.cholesky().context("the second moment of its input is not positive definite")?.inverse();
    Ok(inverse.cholesky().context("the inverse moment of its input is not positive definite")?.unpack())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::moments;
    use crate::methods::scale;
    use crate::random::Random;

    #[test]
    fn feedback_reduces_output_error_of_correlated_inputs() {
        let (rows, cols) = (16, 48);
        let mut random = Random::new(7);
        let data = (0..rows * cols).map(|_| random.unit()).collect();
        let matrix = WeightMatrix { name: "w".into(), rows, cols, data };
        // Inputs of 8 hidden causes.
        let mixing = DMatrix::from_fn(cols, 8, |_, _| f64::from(random.unit()));
        let x = mixing * DMatrix::from_fn(8, 400, |_, _| f64::from(random.unit()));
        let moments = Moments { second: &x * x.transpose() / 400.0, mean: vec![0.0; cols], count: 400 };
        for width in [Width::W2, Width::W3, Width::W4] {
            for group in [0, 32] {
                let error = |q: &Quantized| moments::relative_error(&matrix, &q.dequantized(), Some(&moments));
                let plain = error(&scale::round_to_nearest(&matrix, width, group));
                let gptq = error(&quantize(&matrix, width, group, &moments).expect("positive definite"));
                assert!(gptq < plain / 3.0, "{width:?} group {group}: {gptq} against {plain}");
            }
        }
    }

    #[test]
    fn uncorrelated_equal_inputs_reduce_to_rounding() {
        let mut random = Random::new(3);
        let matrix =
            WeightMatrix { name: "w".into(), rows: 5, cols: 20, data: (0..100).map(|_| random.unit()).collect() };
        let moments = Moments { second: DMatrix::identity(20, 20), mean: vec![0.0; 20], count: 1 };
        let gptq = quantize(&matrix, Width::W3, 0, &moments).expect("positive definite");
        assert_eq!(gptq.codes, scale::round_to_nearest(&matrix, Width::W3, 0).codes);
    }
}
