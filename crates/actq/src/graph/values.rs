//! Values and weight matrices of a network.

use crate::numbers::square;

/// Index of a value: 0 is the observation; `i + 1` is the output of node `i`.
pub type ValueId = usize;

/// A weight matrix, row-major, rows are outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightMatrix {
    /// The tensor's name.
    pub name: String,
    /// Outputs.
    pub rows: usize,
    /// Inputs.
    pub cols: usize,
    /// `rows * cols` weights.
    pub data: Vec<f32>,
}

impl WeightMatrix {
    /// Returns the sum of squares of each column.
    pub fn column_energies(&self) -> Vec<f64> {
        let mut energies = vec![0.0; self.cols];
        for row in self.data.chunks_exact(self.cols) {
            energies.iter_mut().zip(row).for_each(|(energy, w)| *energy += square(f64::from(*w)));
        }
        energies
    }
}
