//! Quantized weight matrices and networks.

use std::collections::BTreeMap;

use actq_kernels::image::block_bytes;
use actq_kernels::layout::{BlockShape, Lanes, Width};
use half::bf16;

use super::learning::Learning;
use super::packing::Activations;
use crate::calibrate::moments::{self, Moments};
use crate::error::{Result, ensure};
use crate::graph::{Graph, WeightMatrix, Weights};

/// A quantized matrix.
#[derive(Clone, Debug)]
pub struct Quantized {
    /// Outputs.
    pub rows: usize,
    /// Inputs.
    pub cols: usize,
    /// Columns per u8 scale; 0 = no group scales.
    pub group: usize,
    /// Width of each row; a row without one has no bits and gives its bias only.
    pub widths: Vec<Option<Width>>,
    /// Scale of each row.
    pub scales: Vec<bf16>,
    /// Group scales, `rows * groups`; empty without groups.
    pub group_scales: Vec<u8>,
    /// Codes, `rows * cols`.
    pub codes: Vec<u8>,
}

impl Quantized {
    /// Returns the group scales of a row.
    pub fn groups(&self) -> usize {
        if self.group == 0 { 0 } else { self.cols.div_ceil(self.group) }
    }

    /// Returns level times group scale at (`row`, `col`): the weight divided by the row's scale.
    pub fn integer(&self, row: usize, col: usize) -> i32 {
        let level = self.widths[row].map_or(0, |width| width.level(self.codes[row * self.cols + col]));
        match self.group {
            0 => level,
            group => level * i32::from(self.group_scales[row * self.groups() + col / group]),
        }
    }

    /// Returns the dequantized weights.
    pub fn dequantized(&self) -> Vec<f32> {
        (0..self.rows * self.cols)
            .map(|i| self.integer(i / self.cols, i % self.cols) as f32 * self.scales[i / self.cols].to_f32())
            .collect()
    }

    /// Formats how many rows have each width: `3`, or `0x12 2x200 4x44`.
    pub fn width_counts(&self) -> String {
        let count = |width: Option<Width>| self.widths.iter().filter(|w| **w == width).count();
        let all = std::iter::once(None).chain(Width::ALL.map(Some));
        let used: Vec<(u32, usize)> =
            all.map(|w| (w.map_or(0, Width::bits), count(w))).filter(|(_, n)| *n > 0).collect();
        match used[..] {
            [(bits, _)] => bits.to_string(),
            _ => used.iter().map(|(bits, n)| format!("{bits}x{n}")).collect::<Vec<_>>().join(" "),
        }
    }

    /// Returns `true` if the blocks' rows follow each other in the order of the output, so that no output steps are
    /// stored. (Missing rows may only be the last.)
    pub fn in_order(blocks: &[(BlockShape, Vec<usize>)]) -> bool {
        blocks.iter().flat_map(|(_, rows)| rows).enumerate().all(|(i, &row)| i == row)
    }

    /// Returns the largest activation magnitude, at most `limit`, whose worst-case row sum stays within int32.
    pub fn x_max(&self, limit: u16) -> Result<u16> {
        let row_sum = |row| (0..self.cols).map(|col| i64::from(self.integer(row, col).abs())).sum::<i64>();
        let largest = (0..self.rows).map(row_sum).max().unwrap_or(0).max(1);
        let x_max = (i64::from(i32::MAX) / largest).min(i64::from(limit)) as u16;
        ensure!(
            x_max >= 127,
            "rows of {} columns overflow int32 even with int8 activations; use another group",
            self.cols
        );
        Ok(x_max)
    }
}

/// Returns the weights of a network with `quantized` matrices.
pub(super) fn dequantized(graph: &Graph, quantized: &[Quantized]) -> Weights {
    let mut weights = Weights::of(graph);
    for (weights, quantized) in weights.matrices.iter_mut().zip(quantized) {
        weights.set(|values| values.copy_from_slice(&quantized.dequantized()));
    }
    weights
}

/// Bit allocation of the rows and columns of a trained matrix, with its reasons. Errors are squared differences of the
/// actions over their variances, summed over the network's outputs.
#[derive(Clone, Debug)]
pub struct RowAllocation {
    /// Width of each row; `None` for rows without bits.
    pub widths: Vec<Option<Width>>,
    /// Energy `g_r sum_c w_rc^2 h_c` of each row.
    pub energy: Vec<f64>,
    /// Predicted error of each row without bits.
    pub removal: Vec<f64>,
    /// Predicted error of each row at its width.
    pub expected: Vec<f64>,
    /// Importance `h` of each column.
    pub inputs: Vec<f64>,
    /// Trained row of each remaining row.
    pub rows: Vec<usize>,
    /// Trained column of each remaining column.
    pub columns: Vec<usize>,
}

/// A quantized network.
#[derive(Clone, Debug)]
pub struct QuantizedNetwork {
    /// Structure: it may have lost elements, and its biases may have changed.
    pub graph: Graph,
    /// Result for each matrix.
    pub outcomes: Vec<Outcome>,
    /// Learning, if the method learns.
    pub learning: Option<Learning>,
    /// Modelled cycles of the rows, without those that removed units save elsewhere; `None` unless the rate limits
    /// them.
    pub cycles: Option<f64>,
}

/// Result for one matrix.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Codes and scales.
    pub quantized: Quantized,
    /// Relative error `E |(W' - W) x|^2 / E |W x|^2` under the second moment of the calibration inputs, or of white
    /// inputs without them. `None` if the matrix was learned, so that its own error means nothing.
    pub error: Option<f64>,
    /// Activation magnitude.
    pub x_max: u16,
    /// Bit allocation of the rows and columns, if they have widths of their own (method distill).
    pub allocation: Option<RowAllocation>,
}

impl Outcome {
    /// Measures the error of a quantized `matrix`.
    pub fn new(
        matrix: &WeightMatrix,
        quantized: Quantized,
        moments: Option<&Moments>,
        activations: Activations,
    ) -> Result<Self> {
        let x_max = quantized.x_max(activations.limit())?;
        let error = Some(moments::relative_error(matrix, &quantized.dequantized(), moments));
        Ok(Self { error, quantized, x_max, allocation: None })
    }

    /// Returns the width of every trained row, removed ones included.
    pub fn trained_widths(&self) -> &[Option<Width>] {
        self.allocation.as_ref().map_or(&self.quantized.widths, |allocation| &allocation.widths)
    }

    /// Returns the number of trained rows of each width; 0: no bits.
    pub fn trained_rows(&self) -> BTreeMap<u32, usize> {
        let mut rows = BTreeMap::new();
        for width in self.trained_widths() {
            *rows.entry(width.map_or(0, Width::bits)).or_default() += 1;
        }
        rows
    }

    /// Returns the number of weights of the trained matrix.
    pub fn trained_weights(&self) -> usize {
        let shape = self.allocation.as_ref().map(|allocation| (allocation.widths.len(), allocation.inputs.len()));
        let (rows, cols) = shape.unwrap_or((self.quantized.rows, self.quantized.cols));
        rows * cols
    }

    /// Returns the predicted error of each trained row, or the one error of the whole matrix if only that is known.
    pub fn expected_errors(&self) -> Vec<f64> {
        let of_matrix = || vec![self.error.unwrap_or(0.0); self.quantized.rows];
        self.allocation.as_ref().map_or_else(of_matrix, |allocation| allocation.expected.clone())
    }

    /// Returns the lanes that the matrix is packed for.
    pub fn lanes(&self) -> Lanes {
        Lanes::of(self.x_max, self.quantized.group)
    }

    /// Returns the rows sorted by width, as blocks: shape and rows of each. A matrix of one width is one block in the
    /// rows' own order.
    pub fn blocks(&self) -> Vec<(BlockShape, Vec<usize>)> {
        let matrix = &self.quantized;
        let lanes = self.lanes();
        Width::ALL
            .into_iter()
            .filter_map(|width| {
                let rows: Vec<usize> = (0..matrix.rows).filter(|&r| matrix.widths[r] == Some(width)).collect();
                let shape = BlockShape { width, lanes, rows: rows.len(), cols: matrix.cols, group: matrix.group };
                (!rows.is_empty()).then_some((shape, rows))
            })
            .collect()
    }

    /// Returns the bytes of codes, padding, scales, output steps and block records.
    pub fn bytes(&self) -> usize {
        let blocks = self.blocks();
        let stepped = !Quantized::in_order(&blocks);
        blocks.iter().map(|(shape, _)| block_bytes(*shape, stepped)).sum()
    }
}
