//! Scales, and rounding to nearest.

use actq_kernels::layout::Width;
use half::bf16;

use super::quantized::Quantized;
use crate::graph::WeightMatrix;

/// Steps of the search for a scale, from [`NARROWEST`] to 1 times the scale that just reaches the largest weight.
const STEPS: usize = 64;
const NARROWEST: f32 = 0.3;

/// The scale that minimises the squared error of `weights`, each weighted by `importance` (equal where empty).
///
/// A grid over the clipping point, then, for the best codes found, the least-squares scale.
pub fn fit(weights: &[f32], importance: &[f64], width: Width) -> f32 {
    let largest = weights.iter().fold(0f32, |m, w| m.max(w.abs()));
    let levels = if width == Width::W8 { 127 } else { width.max_level() };
    let widest = largest / levels as f32;
    if widest == 0.0 {
        return widest;
    }
    let weight_of = |i: usize| importance.get(i).copied().unwrap_or(1.0);
    let mut best = (f64::INFINITY, widest);
    for step in 0..=STEPS {
        let scale = widest * (NARROWEST + (1.0 - NARROWEST) * step as f32 / STEPS as f32);
        let (mut wl, mut ll, mut ww) = (0f64, 0f64, 0f64);
        for (i, &w) in weights.iter().enumerate() {
            let level = f64::from(width.level(width.nearest_code(w / scale)));
            let (w, h) = (f64::from(w), weight_of(i));
            wl += h * w * level;
            ll += h * level * level;
            ww += h * w * w;
        }
        if ll > 0.0 && wl > 0.0 {
            // The error left at the least-squares scale wl / ll of these codes.
            let error = ww - wl * wl / ll;
            if error < best.0 {
                best = (error, (wl / ll) as f32);
            }
        }
    }
    best.1
}

/// Row and group scales of a matrix, before its codes are chosen.
pub struct Scales {
    /// Columns per group; 0 = none.
    pub group: usize,
    /// One per row.
    pub rows: Vec<bf16>,
    /// `rows * groups`.
    pub groups: Vec<u8>,
}

impl Scales {
    /// Fits the scales of every row, or of every group of every row; those of rows without a width are 1. `importance`
    /// has an entry per column, or one per weight, or none.
    pub fn fit(matrix: &WeightMatrix, widths: &[Option<Width>], group: usize, importance: &[f64]) -> Self {
        let mut scales = Self { group, rows: Vec::new(), groups: Vec::new() };
        for (r, (row, width)) in matrix.data.chunks_exact(matrix.cols).zip(widths).enumerate() {
            let importance = if importance.len() > matrix.cols { &importance[r * matrix.cols..] } else { importance };
            let fit = |w: &[f32], importance: &[f64]| width.map_or(1.0, |width| fit(w, importance, width));
            if group == 0 {
                scales.rows.push(bf16::from_f32(fit(row, importance)));
                continue;
            }
            let wanted: Vec<f32> = row
                .chunks(group)
                .enumerate()
                .map(|(g, w)| fit(w, importance.get(g * group..).unwrap_or(&[])))
                .collect();
            let largest = wanted.iter().fold(0f32, |m, s| m.max(*s));
            let base = bf16::from_f32(largest / 255.0);
            scales.rows.push(base);
            let base = base.to_f32();
            scales.groups.extend(wanted.iter().map(|s| {
                // 0 would lose the group for error feedback to come.
                if base > 0.0 { (s / base).round().clamp(1.0, 255.0) as u8 } else { 1 }
            }));
        }
        scales
    }

    /// What the row's scale is multiplied with at (`row`, `col`); 1 where there are no groups.
    pub fn group_scale(&self, row: usize, col: usize) -> u8 {
        match self.group {
            0 => 1,
            group => self.groups[row * (self.groups.len() / self.rows.len()) + col / group],
        }
    }

    /// What a level is multiplied with at (`row`, `col`).
    pub fn at(&self, row: usize, col: usize) -> f32 {
        self.rows[row].to_f32() * f32::from(self.group_scale(row, col))
    }

    /// The code nearest to `weight` at (`row`, `col`).
    pub fn code(&self, width: Width, row: usize, col: usize, weight: f32) -> u8 {
        let scale = self.at(row, col);
        width.nearest_code(if scale > 0.0 { weight / scale } else { 0.0 })
    }
}

/// Rounds every weight to the nearest level of its scale.
pub fn round_to_nearest(matrix: &WeightMatrix, width: Width, group: usize) -> Quantized {
    round_to(matrix, width, Scales::fit(matrix, &vec![Some(width); matrix.rows], group, &[]))
}

/// Rounds every weight to the nearest level of these scales.
pub fn round_to(matrix: &WeightMatrix, width: Width, scales: Scales) -> Quantized {
    let codes =
        matrix.data.iter().enumerate().map(|(i, &w)| scales.code(width, i / matrix.cols, i % matrix.cols, w)).collect();
    Quantized {
        rows: matrix.rows,
        cols: matrix.cols,
        group: scales.group,
        widths: vec![Some(width); matrix.rows],
        scales: scales.rows,
        group_scales: scales.groups,
        codes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bell-shaped sample without a random generator: the quantiles of a logistic distribution.
    fn bell(n: usize) -> Vec<f32> {
        (0..n).map(|i| (i as f32 + 0.5) / n as f32).map(|p| (p / (1.0 - p)).ln()).collect()
    }

    fn error(weights: &[f32], scale: f32, width: Width) -> f32 {
        weights.iter().map(|w| (w - width.level(width.nearest_code(w / scale)) as f32 * scale).powi(2)).sum()
    }

    #[test]
    fn the_fitted_scale_is_near_the_best_of_a_fine_grid() {
        let weights = bell(257);
        for width in [Width::W2, Width::W3, Width::W4] {
            let found = error(&weights, fit(&weights, &[], width), width);
            let best = (1..4000).map(|i| error(&weights, i as f32 * 1e-3, width)).fold(f32::MAX, f32::min);
            assert!(found <= best * 1.02, "{width:?}: {found} against {best}");
        }
    }

    #[test]
    fn eight_bits_clip_no_more_than_a_step_of_a_bell_shaped_row() {
        let weights = bell(100);
        let scale = fit(&weights, &[], Width::W8);
        let worst =
            weights.iter().map(|w| (w - Width::W8.level(Width::W8.nearest_code(w / scale)) as f32 * scale).abs());
        assert!(worst.fold(0.0, f32::max) <= scale);
    }

    #[test]
    fn a_zero_matrix_stays_zero() {
        let matrix = WeightMatrix { name: "z".into(), rows: 3, cols: 40, data: vec![0.0; 120] };
        for width in Width::ALL {
            for group in [0, 32] {
                assert!(round_to_nearest(&matrix, width, group).dequantized().iter().all(|w| *w == 0.0));
            }
        }
    }
}
