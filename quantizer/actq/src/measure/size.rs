//! Size of an image and its matrices.

use std::collections::BTreeSet;

use actq_kernels::Image;
use actq_kernels::image::{Matrix, Op, OpKind};

use crate::graph::ops::Balance;

/// Returns the bits per weight of the policy as it was trained, over the number of the original network's weights.
/// Codes, padding, scales, output steps and block records of all matrices count, and the constants that the quantizer
/// put before them. A matrix that several operations share counts once.
pub fn bits_per_weight(image: &Image<'_>) -> f64 {
    let bytes: usize = distinct(image).iter().map(Matrix::weight_bytes).sum();
    let constants: usize = image.ops().map(|op| added_bytes(&op)).sum();
    8.0 * (bytes + constants) as f64 / image.source_weights().max(1) as f64
}

/// Returns the bytes of the operation's constants, if the quantizer put it before a matrix.
fn added_bytes(op: &Op<'_>) -> usize {
    match op.kind {
        OpKind::Normalize { added: true } => Balance::bytes(op.dst().len),
        OpKind::RmsNorm if op.constant(0) == Balance::FREE_EPS => Balance::bytes_without_means(op.dst().len),
        _ => 0,
    }
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
