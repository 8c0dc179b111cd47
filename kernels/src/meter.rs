//! The budget of a slice: code that runs an image in slices asks here how far it may go. It does not know any cost.

use crate::image::{Image, Op};
use crate::layout::{BlockShape, STRIP};

/// Rows whose sums are on the stack together.
pub(crate) const RUN: usize = 8 * STRIP;

/// A kind of work, with everything that its cost depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Work<'w> {
    /// Entering an operation, at its start or inside it.
    Enter(&'w Op<'w>),
    /// Elements of an operation, or units of a norm.
    Elements(&'w Op<'w>),
    /// Finding the scale of an input of this number of values.
    Magnitude(usize),
    /// Initializing outputs before rows are added to them.
    Start(OutputStart),
    /// Preparing an input for blocks of this shape.
    Prepare(BlockShape),
    /// Strips of eight of a block's rows, whose outputs are `in_order` or by output steps, and `start` from the biases.
    Strips { shape: BlockShape, in_order: bool, start: bool },
    /// Computing the action from the network's output.
    Act(&'w Image<'w>),
}

/// The values of outputs before rows are added to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputStart {
    /// Zeros.
    Zero,
    /// The biases.
    Bias,
    /// The old values.
    Kept,
    /// The old values plus the biases.
    Added,
}

impl OutputStart {
    /// Returns the start of an operation that accumulates or not, with biases or without.
    pub(crate) const fn of(accumulate: bool, bias: bool) -> Self {
        match (accumulate, bias) {
            (false, false) => Self::Zero,
            (false, true) => Self::Bias,
            (true, false) => Self::Kept,
            (true, true) => Self::Added,
        }
    }
}

/// A limit of the work in a slice.
pub(crate) trait Meter {
    /// Takes as many of `units` as the budget allows, and returns their number.
    fn take(&mut self, units: usize, work: Work<'_>) -> usize;

    /// Returns `false` if it allows all work.
    fn is_limited(&self) -> bool;
}

/// No limit. A program without slices computes no cost and does not include the cost model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unlimited;

impl Meter for Unlimited {
    #[inline(always)]
    fn take(&mut self, units: usize, _: Work<'_>) -> usize {
        units
    }

    #[inline(always)]
    fn is_limited(&self) -> bool {
        false
    }
}
