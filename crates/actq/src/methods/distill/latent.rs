//! A matrix during learning: codes before rounding, in units of the step, and logarithms of the scales.

use actq_kernels::Width;
use actq_kernels::math;
use actq_kernels::round::ROUND;
use half::bf16;

use super::adam::{Adam, Moments, Stride, step};
use crate::graph::arrays::LANES;
use crate::graph::{Matrix, STRIP, WeightMatrix};
use crate::methods::quantized::Quantized;
use crate::methods::scale::Scales;
use crate::simd::wide;

/// Least scale, so that learning can change it.
const SMALLEST: f32 = 1e-12;

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
pub(super) enum RateScaling {
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

    /// Rounds to the nearest code, ties to even. The trick is exact in the range of codes. (The standard library's
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
    fn stride(self, scaling: RateScaling) -> f32 {
        const OF_2_BITS: f32 = 3.0;
        match scaling {
            RateScaling::Equal => 1.0,
            RateScaling::ByWidth => ((self.high - self.low) / OF_2_BITS).sqrt(),
        }
    }

    /// Turns the derivatives by weights of one scale into those by their codes; returns that by the logarithm of the
    /// scale.
    #[inline(always)]
    fn through(self, grads: &mut [f32], codes: &[f32], scale: f32) -> f32 {
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
        let of_rows = latent.codes.chunks_mut(cols).zip(matrix.data.chunks(cols)).zip(widths).enumerate();
        for (r, ((codes, weights), width)) in of_rows {
            let Some(grid) = width.map(Grid::of) else { continue };
            let (group, scales) = scales(&latent.fitted, 0.0, r, cols);
            let of_groups = codes.chunks_mut(group).zip(weights.chunks(group)).zip(scales);
            for ((codes, weights), scale) in of_groups {
                codes.iter_mut().zip(weights).for_each(|(code, w)| *code = (w / scale - grid.base) / grid.step);
            }
        }
        latent
    }

    /// Returns the rows in strips that learn independently of each other, as [`Matrix::strips`] does.
    pub(super) fn strips(&mut self) -> impl Iterator<Item = Strip<'_>> {
        let Self { cols, widths, codes, log_scales, fitted, adam_codes, adam_scales, .. } = self;
        let (cols, fitted) = (*cols, &*fitted);
        let of_codes = codes.chunks_mut(STRIP * cols.max(1)).zip(adam_codes.chunks(STRIP * cols.max(1)));
        let of_scales = log_scales.chunks_mut(STRIP).zip(adam_scales.chunks(STRIP));
        let strips = widths.chunks(STRIP).zip(of_codes).zip(of_scales).enumerate();
        strips.map(move |(i, ((widths, (codes, of_codes)), (log_scales, of_scales)))| Strip {
            from: i * STRIP,
            cols,
            widths,
            fitted,
            codes,
            log_scales,
            of_codes,
            of_scales,
        })
    }

    /// Writes the weights of the rounded codes.
    pub(super) fn write(&mut self, matrix: &mut Matrix) {
        self.strips().zip(matrix.strips()).for_each(|(strip, mut to)| to.set(|weights| strip.weights(weights)));
    }

    /// Returns the rounded codes.
    pub(super) fn quantized(&self) -> Quantized {
        let Self { rows, cols, .. } = *self;
        let grids: Vec<Option<Grid>> = self.widths.iter().map(|width| width.map(Grid::of)).collect();
        let code = |(at, code): (usize, &f32)| grids[at / cols].map_or(0, |grid| grid.round(*code) as i32 as u8);
        Quantized {
            rows,
            cols,
            group: self.fitted.group,
            widths: self.widths.clone(),
            scales: (0..rows).map(|r| scale(&self.fitted, self.log_scales[r], r)).collect(),
            group_scales: self.fitted.groups.clone(),
            codes: self.codes.iter().enumerate().map(code).collect(),
        }
    }
}

/// Rows of a matrix during learning.
pub(super) struct Strip<'a> {
    /// First row.
    from: usize,
    cols: usize,
    widths: &'a [Option<Width>],
    fitted: &'a Scales,
    codes: &'a mut [f32],
    log_scales: &'a mut [f32],
    of_codes: Moments<'a>,
    of_scales: Moments<'a>,
}

/// Strides of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct LearningRates {
    pub(super) codes: Stride,
    pub(super) scales: Stride,
    /// Codes of rows wider than 2 bits.
    pub(super) scaling: RateScaling,
}

impl Strip<'_> {
    /// Writes the weights of the rounded codes, row by row.
    pub(super) fn weights(&self, out: &mut [f32]) {
        let rows = out.chunks_mut(self.cols).zip(self.codes.chunks(self.cols)).zip(self.widths).enumerate();
        for (r, ((out, codes), width)) in rows {
            let Some(grid) = width.map(Grid::of) else {
                out.fill(0.0);
                continue;
            };
            let (group, scales) = scales(self.fitted, self.log_scales[r], self.from + r, self.cols);
            for ((out, codes), scale) in out.chunks_mut(group).zip(codes.chunks(group)).zip(scales) {
                wide(
                    #[inline(always)]
                    || out.iter_mut().zip(codes).for_each(|(w, c)| *w = grid.level(*c) * scale),
                );
            }
        }
    }

    /// Moves codes and scales along `grads`, the derivative by the weights, which becomes that by the codes.
    pub(super) fn learn(&mut self, grads: &mut [f32], rates: LearningRates) {
        let Self { from, cols, widths, fitted, .. } = *self;
        let moments = self.of_codes.first.chunks_mut(cols).zip(self.of_codes.second.chunks_mut(cols));
        let rows = self.codes.chunks_mut(cols).zip(grads.chunks_mut(cols)).zip(moments).zip(widths).enumerate();
        for (r, (((codes, grads), (first, second)), width)) in rows {
            let Some(grid) = width.map(Grid::of) else { continue };
            let (group, scales) = scales(fitted, self.log_scales[r], from + r, cols);
            let by_scale: f32 = wide(
                #[inline(always)]
                || {
                    let groups = grads.chunks_mut(group).zip(codes.chunks(group)).zip(&scales);
                    let by_scale = groups.map(|((grads, codes), scale)| grid.through(grads, codes, *scale)).sum();
                    step(codes, grads, Moments { first, second }, rates.codes.times(grid.stride(rates.scaling)));
                    by_scale
                },
            );
            let Moments { first, second } = &mut self.of_scales;
            let of_row = Moments { first: &mut first[r..=r], second: &mut second[r..=r] };
            step(&mut self.log_scales[r..=r], &[by_scale], of_row, rates.scales);
        }
    }
}

fn scale(fitted: &Scales, log_scale: f32, row: usize) -> bf16 {
    bf16::from_f32(fitted.rows[row].to_f32().max(SMALLEST) * math::exp(log_scale))
}

/// Returns the columns of a group, and the factors of a row's levels, group by group.
fn scales(fitted: &Scales, log_scale: f32, row: usize, cols: usize) -> (usize, Vec<f32>) {
    let group = if fitted.group == 0 { cols } else { fitted.group };
    let scale = scale(fitted, log_scale, row).to_f32();
    (group, (0..cols).step_by(group).map(|start| scale * f32::from(fitted.group_scale(row, start))).collect())
}
