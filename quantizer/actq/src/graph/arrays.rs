//! Arrays `[sample, element]` and their operations: products in either order of summing, and rounding as in the
//! kernels.

use std::ops::Range;

use actq_kernels::round::ROUND;
use actq_kernels::x::TINY;
use ndarray::{Array2, ArrayView1, ArrayView2, ArrayViewMut1, ArrayViewMut2, Axis, linalg::general_mat_mul, s};

/// Order of the sum over a row. The results differ in their last bits, and images depend on both orders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sums {
    /// First element to last: the same bits on every machine. Evaluations of single frames and all statistics of the
    /// matrices' inputs use it.
    #[default]
    InOrder,
    /// In blocks, at the machine's full speed: for batches.
    Blocked,
}

impl Sums {
    /// Returns the sum of a row.
    pub fn sum(self, row: &ArrayView1<'_, f32>) -> f32 {
        match self {
            Self::InOrder => row.iter().sum(),
            Self::Blocked => row.sum(),
        }
    }

    /// Computes `x W' + bias`: `[sample, row]`, rows contiguous.
    pub fn affine(self, x: &Array2<f32>, w: &Array2<f32>, bias: &[f32]) -> Array2<f32> {
        let mut y = Array2::zeros((x.nrows(), bias.len()));
        y += &ArrayView1::from(bias);
        match self {
            Self::InOrder => add_in_order(x, w, y.view_mut()),
            Self::Blocked => general_mat_mul(1.0, x, &w.t(), 1.0, &mut y),
        }
        y
    }

    /// Prepares `w` for many products with few rows each.
    pub fn repeated(self, w: &Array2<f32>) -> Repeated<'_> {
        match self {
            Self::InOrder => Repeated::InOrder(w),
            Self::Blocked => Repeated::Blocked(transposed(w)),
        }
    }
}

/// A matrix for many products with few rows each.
#[derive(Debug)]
pub enum Repeated<'a> {
    /// Unchanged, `[row, col]`.
    InOrder(&'a Array2<f32>),
    /// Transposed, `[col, row]`: a product with few rows takes half the time, since no columns are gathered.
    Blocked(Array2<f32>),
}

impl Repeated<'_> {
    /// Computes `y += x W'`.
    pub fn add_product(&self, x: &Array2<f32>, mut y: ArrayViewMut2<'_, f32>) {
        match self {
            Self::InOrder(w) => add_in_order(x, w, y),
            Self::Blocked(transposed) => general_mat_mul(1.0, x, transposed, 1.0, &mut y),
        }
    }
}

/// Returns `w'` with contiguous rows. It copies tile by tile: column by column, every value would be a cache miss.
fn transposed(w: &Array2<f32>) -> Array2<f32> {
    const TILE: usize = 16;
    let mut transposed = Array2::zeros((w.ncols(), w.nrows()));
    for (strip, mut to) in w.axis_chunks_iter(Axis(0), TILE).zip(transposed.axis_chunks_iter_mut(Axis(1), TILE)) {
        for (tile, mut to) in strip.axis_chunks_iter(Axis(1), TILE).zip(to.axis_chunks_iter_mut(Axis(0), TILE)) {
            to.assign(&tile.t());
        }
    }
    transposed
}

fn add_in_order(x: &Array2<f32>, w: &Array2<f32>, mut y: ArrayViewMut2<'_, f32>) {
    for (mut y, x) in y.rows_mut().into_iter().zip(x.rows()) {
        for (y, w) in y.iter_mut().zip(w.rows()) {
            *y += contiguous(&w).iter().zip(contiguous(&x)).map(|(w, x)| w * x).sum::<f32>();
        }
    }
}

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
        let top = f32::from(x_max);
        for mut row in y.rows_mut() {
            let amax = row.iter().fold(0f32, |m, v| m.max(v.abs()));
            if amax > TINY {
                let (inverse, scale) = (top / amax, amax / top);
                row.mapv_inplace(|v| ((v * inverse + ROUND) - ROUND) * scale);
            }
        }
    }
    y
}

/// Adds the rows of `dy` to `sum`.
pub fn sum_rows(dy: &Array2<f32>, sum: &mut [f32]) {
    for row in dy.rows() {
        sum.iter_mut().zip(row).for_each(|(s, d)| *s += d);
    }
}

/// Returns a row as a slice. All values have the standard layout.
pub fn contiguous<'a>(row: &'a ArrayView1<'_, f32>) -> &'a [f32] {
    row.as_slice().expect("rows are contiguous")
}

/// As [`contiguous`].
pub fn contiguous_mut<'a>(row: &'a mut ArrayViewMut1<'_, f32>) -> &'a mut [f32] {
    row.as_slice_mut().expect("rows are contiguous")
}
