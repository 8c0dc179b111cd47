//! A matrix of weights for products, and the derivative by it.

use ndarray::{Array2, ArrayViewMut2};

use super::values::WeightMatrix;
use crate::gemm::{Panels, add_product};

/// A matrix of weights, `[row, column]`, with its panels for products.
#[derive(Clone, Debug)]
pub struct Matrix {
    values: Array2<f32>,
    panels: Panels,
}

impl Matrix {
    pub(super) fn of(matrix: &WeightMatrix) -> Self {
        let values = Array2::from_shape_fn((matrix.rows, matrix.cols), |(r, c)| matrix.data[r * matrix.cols + c]);
        Self { panels: Panels::transposed(values.view()), values }
    }

    /// Returns the weights.
    pub fn values(&self) -> &Array2<f32> {
        &self.values
    }

    /// Changes the weights, row by row.
    pub fn set(&mut self, change: impl FnOnce(&mut [f32])) {
        change(self.values.as_slice_mut().unwrap_or_default());
        self.panels.refill(self.values.view());
    }

    /// Adds `x W'` to `y`.
    pub(super) fn add_product(&self, x: &Array2<f32>, y: ArrayViewMut2<'_, f32>) {
        add_product(x.view(), &self.panels, y);
    }

    /// Packs the weights for products `dy W`.
    pub(super) fn back(&self) -> Panels {
        Panels::of(self.values.view())
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
