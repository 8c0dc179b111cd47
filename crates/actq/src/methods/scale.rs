//! Scales, and rounding to nearest.

use actq_kernels::layout::Width;
use half::bf16;

use super::quantized::Quantized;
use crate::graph::WeightMatrix;

/// Steps of the search for a scale, from [`NARROWEST`] to 1 times the scale that just reaches the largest weight.
const STEPS: usize = 64;
const NARROWEST: f32 = 0.3;

/// Fits the scale that minimizes the squared error of `weights`, each weighted by `importance` (equal if empty).
///
/// It searches a grid over the clipping point, then takes the least-squares scale of the best codes.
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
    /// Columns per group; 0 = no group scales.
    pub group: usize,
    /// Row scales.
    pub rows: Vec<bf16>,
    /// Group scales, `rows * groups`.
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
                // With 0, later error feedback would lose the group.
                if base > 0.0 { (s / base).round().clamp(1.0, 255.0) as u8 } else { 1 }
            }));
        }
        scales
    }

    /// Returns the group scale at (`row`, `col`); 1 without groups.
    pub fn group_scale(&self, row: usize, col: usize) -> u8 {
        match self.group {
            0 => 1,
            group => self.groups[row * (self.groups.len() / self.rows.len()) + col / group],
        }
    }

    /// Returns the factor of a level at (`row`, `col`).
    pub fn at(&self, row: usize, col: usize) -> f32 {
        self.rows[row].to_f32() * f32::from(self.group_scale(row, col))
    }

    /// Returns the code nearest to `weight` at (`row`, `col`).
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

    /// Makes a bell-shaped sample without a random generator: the quantiles of a logistic distribution.
    fn bell(n: usize) -> Vec<f32> {
        (0..n).map(|i| (i as f32 + 0.5) / n as f32).map(|p| (p / (1.0 - p)).ln()).collect()
    }

    fn error(weights: &[f32], scale: f32, width: Width) -> f32 {
        weights.iter().map(|w| (w - width.level(width.nearest_code(w / scale)) as f32 * scale).powi(2)).sum()
    }

    #[test]
    fn fitted_scales_nearly_match_a_fine_grid() {
        let weights = bell(257);
        for width in [Width::W2, Width::W3, Width::W4] {
            let found = error(&weights, fit(&weights, &[], width), width);
            let best = (1..4000).map(|i| error(&weights, i as f32 * 1e-3, width)).fold(f32::MAX, f32::min);
            assert!(found <= best * 1.02, "{width:?}: {found} against {best}");
        }
    }

    #[test]
    fn eight_bits_clip_at_most_one_step() {
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
