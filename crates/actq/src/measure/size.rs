//! Size of an image and its matrices.

use std::collections::BTreeSet;
use std::fmt;

use actq_kernels::Image;
use actq_kernels::image::{Matrix, Op, OpKind};

use crate::graph::ops::Balance;

/// Returns the bits per weight of the policy as it was trained, over the number of the original network's weights.
/// Codes, padding, scales, output steps and block records of all matrices count, and the constants that the quantizer
/// put before them. A matrix that several operations share counts once.
pub fn bits_per_weight(image: &Image<'_>) -> f64 {
    8.0 * weight_bytes(image) as f64 / image.source_weights().max(1) as f64
}

/// Returns the bytes that [`bits_per_weight`] counts.
fn weight_bytes(image: &Image<'_>) -> usize {
    let bytes: usize = distinct(image).iter().map(Matrix::weight_bytes).sum();
    bytes + image.ops().map(|op| added_bytes(&op)).sum::<usize>()
}

/// Returns the bytes of the operation's constants, if the quantizer put it before a matrix.
fn added_bytes(op: &Op<'_>) -> usize {
    match op.kind {
        OpKind::Normalize { added: true } => Balance::bytes(op.dst().len),
        OpKind::RmsNorm if op.constant(0) == Balance::FREE_EPS => Balance::bytes_without_means(op.dst().len),
        _ => 0,
    }
}

/// Bytes of an image that are no weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beside {
    /// Biases of the matrices' rows.
    pub biases: usize,
    /// Self-test vector.
    pub self_test: usize,
    /// Header, records of operations and matrices, norms, the action contract, names.
    pub tables: usize,
}

impl Beside {
    /// Counts the bytes. Those that [`bits_per_weight`] counts are no part of them.
    pub fn of(image: &Image<'_>) -> Self {
        let weights = weight_bytes(image);
        let biases: usize =
            distinct(image).iter().filter(|matrix| matrix.has_bias()).map(|matrix| 4 * matrix.rows).sum();
        let steps = (0..image.self_test_steps()).filter_map(|step| image.self_test(step));
        let self_test: usize = steps.map(|(obs, out)| 4 * (obs.len() + out.len())).sum();
        let rest = image.bytes().saturating_sub(weights);
        // Equal constants share their place.
        let biases = biases.min(rest.saturating_sub(self_test));
        Self { biases, self_test, tables: rest.saturating_sub(biases + self_test) }
    }

    /// Returns the bytes of all.
    pub fn bytes(self) -> usize {
        self.biases + self.self_test + self.tables
    }
}

impl fmt::Display for Beside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { biases, self_test, tables } = self;
        write!(f, "{biases} bytes of biases, {self_test} of self-test, {tables} of header and tables")
    }
}

/// Returns the bits per weight of the whole image, over the number of the original network's weights.
pub fn file_bits_per_weight(image: &Image<'_>) -> f64 {
    8.0 * image.bytes() as f64 / image.source_weights().max(1) as f64
}

/// Formats bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Returns the matrices, each once, in the order of the operations that first use them.
pub fn distinct<'a>(image: &Image<'a>) -> Vec<Matrix<'a>> {
    let mut seen = BTreeSet::new();
    let place = |m: &Matrix<'a>| m.blocks().next().map(|rows| rows.block.rows_from(0).as_ptr() as usize);
    image.ops().filter_map(|op| op.matrix()).filter(|m| seen.insert(place(m))).collect()
}
