//! Arrays `[sample, element]` and their operations, among them rounding as in the kernels.

use std::ops::Range;

use actq_kernels::activations::TINY;
use actq_kernels::round::ROUND;
use ndarray::{Array2, ArrayView1, ArrayView2, ArrayViewMut1, ArrayViewMut2, s};

use crate::simd::wide;

/// Returns the range of rows of one step, in a sequence of `batch` rows per step.
pub fn step_rows(step: usize, batch: usize) -> Range<usize> {
    step * batch..(step + 1) * batch
}

/// Returns a range of rows.
pub fn rows(array: &Array2<f32>, range: Range<usize>) -> ArrayView2<'_, f32> {
    array.slice(s![range, ..])
}

/// As [`rows`].
pub fn rows_mut(array: &mut Array2<f32>, range: Range<usize>) -> ArrayViewMut2<'_, f32> {
    array.slice_mut(s![range, ..])
}

/// Rounds every row to integers up to `x_max` with a scale per row, as the kernels do; 0 = no rounding.
pub fn round_rows(x: ArrayView2<'_, f32>, x_max: u16) -> Array2<f32> {
    let mut y = x.to_owned();
    if x_max > 0 {
        for mut row in y.rows_mut() {
            let row = contiguous_mut(&mut row);
            wide(
                #[inline(always)]
                || round(row, f32::from(x_max)),
            );
        }
    }
    y
}

/// Returns `x` as integers up to `x_max` and a scale for every run of `len` values, as the kernels do; with 0, the values
/// with scales of 1.
pub fn rounded(x: &[f32], len: usize, x_max: u16) -> (Vec<f32>, Vec<f32>) {
    let (mut integers, mut scales) = (x.to_vec(), vec![1.0; x.len() / len]);
    let top = f32::from(x_max);
    for (run, scale) in integers.chunks_exact_mut(len).zip(&mut scales).filter(|_| x_max > 0) {
        let [inverse, of_run] = factors(run, top).unwrap_or_default();
        *scale = of_run;
        run.iter_mut().for_each(|v| *v = (*v * inverse + ROUND) - ROUND);
    }
    (integers, scales)
}

/// Returns the factors to integers up to `top` and back; `None` for values that the kernels take for zeros.
#[inline(always)]
fn factors(run: &[f32], top: f32) -> Option<[f32; 2]> {
    let amax = run.iter().fold(0f32, |m, v| m.max(v.abs()));
    (amax > TINY).then(|| [top / amax, amax / top])
}

#[inline(always)]
fn round(row: &mut [f32], top: f32) {
    if let Some([inverse, scale]) = factors(row, top) {
        row.iter_mut().for_each(|v| *v = ((*v * inverse + ROUND) - ROUND) * scale);
    }
}

/// Adds the rows of `dy` to `sum`.
pub fn sum_rows(dy: &Array2<f32>, sum: &mut [f32]) {
    for row in dy.rows() {
        let row = contiguous(&row);
        wide(
            #[inline(always)]
            || sum.iter_mut().zip(row).for_each(|(s, d)| *s += d),
        );
    }
}

/// Partial sums, which stay in vector registers. Their number fixes the order of additions on every processor.
pub const LANES: usize = 16;

/// Returns the sum of a function of each value.
#[inline(always)]
pub fn sum(values: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let mut sums = [0.0; LANES];
    for values in values.chunks(LANES) {
        sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += of(*v));
    }
    sums.iter().sum()
}

/// Returns the sum of the products of two rows' values.
#[inline(always)]
pub fn sum_of_products(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        sums.iter_mut().zip(a.iter().zip(b)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum()
}

/// Returns a row as a slice. All values have the standard layout.
pub fn contiguous<'a>(row: &'a ArrayView1<'_, f32>) -> &'a [f32] {
    row.as_slice().expect("rows are contiguous")
}

/// As [`contiguous`].
pub fn contiguous_mut<'a>(row: &'a mut ArrayViewMut1<'_, f32>) -> &'a mut [f32] {
    row.as_slice_mut().expect("rows are contiguous")
}
