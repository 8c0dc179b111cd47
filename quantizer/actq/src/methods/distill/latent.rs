//! A matrix during learning: codes before rounding, in units of the step, and logarithms of the scales.

use actq_kernels::Width;
use actq_kernels::math;
use actq_kernels::round::ROUND;
use half::bf16;
use rayon::prelude::*;

use super::adam::{Adam, Stride, step};
use crate::graph::WeightMatrix;
use crate::methods::quantized::Quantized;
use crate::methods::scale::Scales;
use crate::simd::wide;

/// Least scale, so that learning can change it.
const SMALLEST: f32 = 1e-12;
/// Rows that a thread takes together.
const ROWS: usize = 16;
/// Partial sums of a derivative by a scale.
const LANES: usize = 16;

/// A matrix during learning.
pub(super) struct Latent {
    rows: usize,
    cols: usize,
    widths: Vec<Option<Width>>,
    /// Codes before rounding, row by row.
    codes: Vec<f32>,
    /// Natural logarithm of each row's scale over the one that learning started from.
    log_scales: Vec<f32>,
    /// Scales that learning started from; group scales stay fixed.
    fitted: Scales,
    adam_codes: Adam,
    adam_scales: Adam,
}

/// Strides of codes of different widths. A wider row has more steps for the same weights, so equal strides change it
/// less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Strides {
    /// Equal, in steps.
    Equal,
    /// In proportion to the root of the number of levels: between equal in steps and equal in weights
    /// (docs/records/2026-11-25-frontier.md).
    ByWidth,
}

/// Rounding of a latent code at a width: lowest and highest code, and the level of code `c`, `step * c + base`.
#[derive(Clone, Copy)]
struct Grid {
    low: f32,
    high: f32,
    step: f32,
    base: f32,
}

impl Grid {
    fn of(width: Width) -> Self {
        let top = width.max_level() as f32;
        match width {
            Width::W8 => Self { low: -127.0, high: 127.0, step: 1.0, base: 0.0 },
            _ => Self { low: 0.0, high: top, step: 2.0, base: -top },
        }
    }

    /// Rounds to the nearest code, ties to even; the trick is exact in the range of codes. (The standard library's
    /// function is a call on processors without an instruction for it.)
    #[inline(always)]
    fn round(self, code: f32) -> f32 {
        ((code + ROUND) - ROUND).clamp(self.low, self.high)
    }

    /// Returns the level of the nearest code.
    #[inline(always)]
    fn level(self, code: f32) -> f32 {
        self.round(code) * self.step + self.base
    }

    /// Returns the rate of codes in units of that of 2 bits.
    fn stride(self, strides: Strides) -> f32 {
        const OF_2_BITS: f32 = 3.0;
        match strides {
            Strides::Equal => 1.0,
            Strides::ByWidth => ((self.high - self.low) / OF_2_BITS).sqrt(),
        }
    }

    /// Turns the derivatives by weights of one scale into those by their codes; returns that by the logarithm of the
    /// scale.
    #[inline(always)]
    fn through(self, grads: &mut [f32], codes: &[f32], scale: f32) -> f32 {
        // Several sums, which the compiler can keep in one vector.
        let mut sums = [0.0; LANES];
        for (grads, codes) in grads.chunks_mut(LANES).zip(codes.chunks(LANES)) {
            for ((g, c), sum) in grads.iter_mut().zip(codes).zip(&mut sums) {
                *sum += *g * self.level(*c);
                // Beyond the grid, only a gradient towards the inside counts.
                let outside = (*c < self.low - 0.5 && *g > 0.0) || (*c > self.high + 0.5 && *g < 0.0);
                *g = if outside { 0.0 } else { *g * self.step * scale };
            }
        }
        sums.iter().sum::<f32>() * scale
    }
}

impl Latent {
    /// Makes latent codes that round to the nearest codes of `matrix`.
    pub(super) fn new(matrix: &WeightMatrix, widths: &[Option<Width>], group: usize, importance: &[f64]) -> Self {
        let (rows, cols) = (matrix.rows, matrix.cols);
        let fitted = Scales::fit(matrix, widths, group, importance);
        let mut latent = Self {
            rows,
            cols,
            widths: widths.to_vec(),
            codes: vec![0.0; rows * cols],
            log_scales: vec![0.0; rows],
            fitted,
            adam_codes: Adam::new(rows * cols),
            adam_scales: Adam::new(rows),
        };
        for r in 0..rows {
            let Some(grid) = latent.grid(r) else { continue };
            for at in r * cols..(r + 1) * cols {
                let scale = latent.scale(r) * f32::from(latent.fitted.group_scale(r, at % cols));
                latent.codes[at] = (matrix.data[at] / scale - grid.base) / grid.step;
            }
        }
        latent
    }

    fn grid(&self, row: usize) -> Option<Grid> {
        self.widths[row].map(Grid::of)
    }

    fn scale(&self, row: usize) -> f32 {
        bf16::from_f32(self.fitted.rows[row].to_f32().max(SMALLEST) * math::exp(self.log_scales[row])).to_f32()
    }

    /// Returns the columns of a group, and the factors of a row's levels, group by group.
    fn scales(&self, row: usize) -> (usize, Vec<f32>) {
        let group = if self.fitted.group == 0 { self.cols } else { self.fitted.group };
        let scale = self.scale(row);
        let of = move |start| scale * f32::from(self.fitted.group_scale(row, start));
        (group, (0..self.cols).step_by(group).map(of).collect())
    }

    /// Writes the weights of the rounded codes, row by row.
    pub(super) fn weights(&self, out: &mut [f32]) {
        let rows = out.par_chunks_mut(self.cols).zip(self.codes.par_chunks(self.cols)).enumerate();
        rows.with_min_len(ROWS).for_each(|(r, (out, codes))| {
            let Some(grid) = self.grid(r) else {
                out.fill(0.0);
                return;
            };
            let (group, scales) = self.scales(r);
            for ((out, codes), scale) in out.chunks_mut(group).zip(codes.chunks(group)).zip(scales) {
                wide(
                    #[inline(always)]
                    || out.iter_mut().zip(codes).for_each(|(w, c)| *w = grid.level(*c) * scale),
                );
            }
        });
    }

    /// Moves codes and scales along `grads`, the derivative by the weights, which becomes that by the codes.
    pub(super) fn learn(&mut self, grads: &mut [f32], (by_code, strides): (Stride, Strides), by_scale: Stride) {
        let cols = self.cols;
        let steps: Vec<_> = (0..self.rows).map(|r| self.grid(r).map(|grid| (grid, self.scales(r)))).collect();
        let Adam { first, second } = &mut self.adam_codes;
        let moments = first.par_chunks_mut(cols).zip(second.par_chunks_mut(cols));
        let rows = self.codes.par_chunks_mut(cols).zip(grads.par_chunks_mut(cols)).zip(moments).zip(&steps);
        let by_scales: Vec<f32> = rows
            .with_min_len(ROWS)
            .map(|(((codes, grads), (first, second)), of_row)| {
                let Some((grid, (group, scales))) = of_row else { return 0.0 };
                wide(
                    #[inline(always)]
                    || {
                        let groups = grads.chunks_mut(*group).zip(codes.chunks(*group)).zip(scales);
                        let by_scale = groups.map(|((grads, codes), scale)| grid.through(grads, codes, *scale)).sum();
                        step(codes, grads, first, second, by_code.times(grid.stride(strides)));
                        by_scale
                    },
                )
            })
            .collect();
        self.adam_scales.step(&mut self.log_scales, &by_scales, by_scale);
    }

    /// Returns the rounded codes.
    pub(super) fn quantized(&self) -> Quantized {
        let Self { rows, cols, .. } = *self;
        let code = |(at, code): (usize, &f32)| self.grid(at / cols).map_or(0, |grid| grid.round(*code) as i32 as u8);
        Quantized {
            rows,
            cols,
            group: self.fitted.group,
            widths: self.widths.clone(),
            scales: (0..rows).map(|r| bf16::from_f32(self.scale(r))).collect(),
            group_scales: self.fitted.groups.clone(),
            codes: self.codes.iter().enumerate().map(code).collect(),
        }
    }
}
