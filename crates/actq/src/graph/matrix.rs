//! A matrix of weights for products, and the derivative by it.

use ndarray::{Array2, ArrayViewMut2, Axis};

use super::values::WeightMatrix;
use crate::gemm::{COLS, Panels, RowStrip, Strip, add_product};

/// Rows of a [`MatrixStrip`].
pub const STRIP: usize = COLS;

/// A matrix of weights W, `[row, column]`, with its panels for products.
#[derive(Clone, Debug)]
pub struct Matrix {
    values: Array2<f32>,
    /// For products `x W'`.
    forth: Panels,
    /// For products `dy W`.
    back: Panels,
}

impl Matrix {
    pub(super) fn of(matrix: &WeightMatrix) -> Self {
        let values = Array2::from_shape_fn((matrix.rows, matrix.cols), |(r, c)| matrix.data[r * matrix.cols + c]);
        Self { forth: Panels::transposed(values.view()), back: Panels::of(values.view()), values }
    }

    /// Returns the weights.
    pub fn values(&self) -> &Array2<f32> {
        &self.values
    }

    /// Changes the weights, row by row.
    pub fn set(&mut self, change: impl FnOnce(&mut [f32])) {
        change(self.values.as_slice_mut().unwrap_or_default());
        self.strips().for_each(|mut strip| strip.set(|_| ()));
    }

    /// Returns the weights of [`STRIP`] rows at a time, to change them on several threads.
    pub fn strips(&mut self) -> impl Iterator<Item = MatrixStrip<'_>> {
        let rows = self.values.axis_chunks_iter_mut(Axis(0), STRIP);
        let panels = self.forth.strips().zip(self.back.row_strips());
        rows.zip(panels).map(|(values, (forth, back))| MatrixStrip { values, forth, back })
    }

    /// Adds `x W'` to `y`.
    pub(super) fn add_product(&self, x: &Array2<f32>, y: ArrayViewMut2<'_, f32>) {
        add_product(x.view(), &self.forth, y);
    }

    /// Returns the panels for products with derivatives by the output, `dy W`, which give those by the operand.
    pub(super) fn back(&self) -> &Panels {
        &self.back
    }
}

/// Some rows of a matrix.
#[derive(Debug)]
pub struct MatrixStrip<'a> {
    values: ArrayViewMut2<'a, f32>,
    forth: Strip<'a>,
    back: RowStrip<'a>,
}

impl MatrixStrip<'_> {
    /// Changes the weights, row by row.
    pub fn set(&mut self, change: impl FnOnce(&mut [f32])) {
        change(self.values.as_slice_mut().unwrap_or_default());
        self.forth.refill(self.values.view());
        self.back.refill(self.values.view());
    }
}

/// The derivative of a loss by a matrix, as the product of its factors: `dy' x`.
#[derive(Debug)]
pub struct Factors {
    /// Index of the matrix.
    pub matrix: usize,
    /// Operand of the product, `[sample, column]`.
    pub x: Array2<f32>,
    /// Derivative by the product, `[sample, row]`.
    pub dy: Array2<f32>,
}
