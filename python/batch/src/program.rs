//! The operations of an image in the form in which a batch runs them.

use actq_kernels::Image;
use actq_kernels::image::{Op, OpKind, Region};
use actq_kernels::math::Function;

use crate::linear::Linear;

/// An operation.
#[derive(Debug)]
pub(crate) enum Operation {
    /// A product, for many heads together.
    Linear(Linear),
    /// A function of each value of a region, with the machine's vector instructions.
    Function(Function, Region),
    /// Any other: the executor runs it for each head.
    Other,
}

/// Returns the operations of an image.
pub(crate) fn operations(image: &Image<'_>) -> Vec<Operation> {
    image.ops().map(|op| operation(&op)).collect()
}

fn operation(op: &Op<'_>) -> Operation {
    match op.kind {
        OpKind::Function(function) => Operation::Function(function, op.dst()),
        _ => Linear::new(op).map_or(Operation::Other, Operation::Linear),
    }
}
