//! A matrix while it learns: codes before rounding, in units of the step, and logarithms of the scales.

use actq_kernels::Width;
use actq_kernels::round::ROUND;
use half::bf16;
use ndarray::Array2;

use crate::graph::WeightMatrix;
use crate::methods::quantized::Quantized;
use crate::methods::scale::Scales;

/// Scales that are smaller count as this, so that their logarithm is finite.
const SMALLEST: f32 = 1e-12;

/// A matrix while it learns.
pub(super) struct Latent {
    widths: Vec<Option<Width>>,
    /// Codes before rounding, `[row, col]`.
    pub(super) codes: Array2<f32>,
    /// Natural logarithm of each row's scale.
    pub(super) log_scales: Vec<f32>,
    /// The scales that learning started from, of which those of groups stay.
    fitted: Scales,
}

/// What rounds a latent code: the lowest and highest code, and the level of code `c`, `step * c + base`.
fn grid(width: Width) -> (f32, f32, f32, f32) {
    match width {
        Width::W8 => (-127.0, 127.0, 1.0, 0.0),
        _ => {
            let top = width.max_level() as f32;
            (0.0, top, 2.0, -top)
        }
    }
}

/// To the nearest integer, ties to even; codes are far from where this ends. (The standard library's is a call where the
/// processor need not have an instruction for it.)
fn round(x: f32) -> f32 {
    (x + ROUND) - ROUND
}

impl Latent {
    /// What rounds to the nearest codes of `matrix`.
    pub(super) fn new(matrix: &WeightMatrix, widths: &[Option<Width>], group: usize, importance: &[f64]) -> Self {
        let fitted = Scales::fit(matrix, widths, group, importance);
        let log_scales: Vec<f32> = fitted.rows.iter().map(|s| s.to_f32().max(SMALLEST).ln()).collect();
        let mut latent =
            Self { widths: widths.to_vec(), codes: Array2::zeros((matrix.rows, matrix.cols)), log_scales, fitted };
        for (r, row) in matrix.data.chunks_exact(matrix.cols).enumerate() {
            let Some(width) = widths[r] else { continue };
            let (_, _, step, base) = grid(width);
            for (c, w) in row.iter().enumerate() {
                latent.codes[[r, c]] = (w / latent.at(r, c) - base) / step;
            }
        }
        latent
    }

    fn scale(&self, row: usize) -> f32 {
        bf16::from_f32(self.log_scales[row].exp()).to_f32()
    }

    /// What a level is multiplied with.
    fn at(&self, row: usize, col: usize) -> f32 {
        self.scale(row) * f32::from(self.fitted.group_scale(row, col))
    }

    /// The weights that the rounded codes stand for.
    pub(super) fn weights(&self, out: &mut Array2<f32>) {
        for (r, width) in self.widths.iter().enumerate() {
            let mut out = out.row_mut(r);
            let Some(width) = *width else {
                out.fill(0.0);
                continue;
            };
            let (low, high, step, base) = grid(width);
            let scale = self.scale(r);
            for (i, (w, c)) in out.iter_mut().zip(self.codes.row(r)).enumerate() {
                let scale = scale * f32::from(self.fitted.group_scale(r, i));
                *w = (round(*c).clamp(low, high) * step + base) * scale;
            }
        }
    }

    /// Turns the derivative by the weights into those by the latent codes (in place) and by the scales' logarithms.
    pub(super) fn chain(&self, grad: &mut Array2<f32>) -> Vec<f32> {
        let mut by_scale = vec![0.0; self.widths.len()];
        for (r, width) in self.widths.iter().enumerate() {
            let mut grad = grad.row_mut(r);
            let Some(width) = *width else {
                grad.fill(0.0);
                continue;
            };
            let (low, high, step, base) = grid(width);
            let scale = self.scale(r);
            for (i, (g, c)) in grad.iter_mut().zip(self.codes.row(r)).enumerate() {
                let scale = scale * f32::from(self.fitted.group_scale(r, i));
                by_scale[r] += *g * (round(*c).clamp(low, high) * step + base) * scale;
                // Beyond the grid only a pull back inside passes.
                let outside = (*c < low - 0.5 && *g > 0.0) || (*c > high + 0.5 && *g < 0.0);
                *g = if outside { 0.0 } else { *g * step * scale };
            }
        }
        by_scale
    }

    /// The rounded codes.
    pub(super) fn quantized(&self) -> Quantized {
        let (rows, cols) = self.codes.dim();
        let code = |r: usize, c: &f32| match self.widths[r] {
            None => 0,
            Some(width) => {
                let (low, high, ..) = grid(width);
                round(*c).clamp(low, high) as i32 as u8
            }
        };
        Quantized {
            rows,
            cols,
            group: self.fitted.group,
            widths: self.widths.clone(),
            scales: (0..rows).map(|r| bf16::from_f32(self.scale(r))).collect(),
            group_scales: self.fitted.groups.clone(),
            codes: self.codes.indexed_iter().map(|((r, _), c)| code(r, c)).collect(),
        }
    }
}
