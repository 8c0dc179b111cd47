//! The operations of an image in the form in which a batch runs them.

use actq_kernels::Image;
use actq_kernels::image::{Op, OpKind, Region};
use actq_kernels::math::Function;
use fearless_simd::Level;

use crate::linear::Linear;

/// An operation.
#[derive(Debug)]
pub(crate) enum Operation {
    /// A product, for many heads together.
    Linear(Box<Linear>),
    /// A function of each value of a region, with the machine's vector instructions.
    Function(Function, Region),
    /// Any other: the executor runs it for each head.
    Other,
}

/// Returns the operations of an image, for a level.
pub(crate) fn operations(level: Level, image: &Image<'_>) -> Vec<Operation> {
    image.ops().map(|op| operation(level, &op)).collect()
}

fn operation(level: Level, op: &Op<'_>) -> Operation {
    match op.kind {
        OpKind::Function(function) => Operation::Function(function, op.dst()),
        _ => Linear::new(level, op).map_or(Operation::Other, |linear| Operation::Linear(linear.into())),
    }
}
