//! Arrays `[sample, element]` and what operations do with them: products in either order of summing, rounding as the kernels
//! round.

use actq_kernels::round::ROUND;
use actq_kernels::x::TINY;
use ndarray::{Array2, ArrayView1, ArrayViewMut1, linalg::general_mat_mul};

/// The order in which a sum over a row is taken. The results differ in their last bits, and images are made from both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sums {
    /// First element to last: the same bits on every machine. Single frames are evaluated so, and all statistics of the
    /// matrices' inputs come from it.
    #[default]
    InOrder,
    /// In blocks, as fast as the machine can: for batches.
    Blocked,
}

impl Sums {
    /// The sum of a row.
    pub fn sum(self, row: &ArrayView1<'_, f32>) -> f32 {
        match self {
            Self::InOrder => row.iter().sum(),
            Self::Blocked => row.sum(),
        }
    }

    /// `sum of x W' + bias` over the terms `(x, W)`: `[sample, row]`, rows contiguous.
    pub fn affine(self, terms: &[(&Array2<f32>, &Array2<f32>)], bias: &[f32]) -> Array2<f32> {
        let samples = terms.first().map_or(0, |(x, _)| x.nrows());
        let mut y = Array2::zeros((samples, bias.len()));
        match self {
            Self::InOrder => {
                add_rows(&mut y, bias);
                for (x, w) in terms {
                    for (mut y, x) in y.rows_mut().into_iter().zip(x.rows()) {
                        for (y, w) in y.iter_mut().zip(w.rows()) {
                            *y += contiguous(&w).iter().zip(contiguous(&x)).map(|(w, x)| w * x).sum::<f32>();
                        }
                    }
                }
            }
            Self::Blocked => {
                for (i, (x, w)) in terms.iter().enumerate() {
                    general_mat_mul(1.0, x, &w.t(), if i == 0 { 0.0 } else { 1.0 }, &mut y);
                }
                add_rows(&mut y, bias);
            }
        }
        y
    }
}

fn add_rows(y: &mut Array2<f32>, bias: &[f32]) {
    for mut row in y.rows_mut() {
        row.iter_mut().zip(bias).for_each(|(y, b)| *y += b);
    }
}

/// Rounds every row to integers of its own scale up to `x_max`, as the kernels do; 0 = not at all.
pub fn round_rows(x: &Array2<f32>, x_max: u16) -> Array2<f32> {
    let mut y = x.clone();
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

/// `sum += rows of dy`
pub fn sum_rows(dy: &Array2<f32>, sum: &mut [f32]) {
    for row in dy.rows() {
        sum.iter_mut().zip(row).for_each(|(s, d)| *s += d);
    }
}

/// A row as a slice. Every value is made in standard layout.
pub fn contiguous<'a>(row: &'a ArrayView1<'_, f32>) -> &'a [f32] {
    row.as_slice().expect("rows are contiguous")
}

/// As [`contiguous`].
pub fn contiguous_mut<'a>(row: &'a mut ArrayViewMut1<'_, f32>) -> &'a mut [f32] {
    row.as_slice_mut().expect("rows are contiguous")
}
