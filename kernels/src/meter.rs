//! Leave to go on: what runs an image in pieces asks here how far it may go, and knows no prices.

use crate::image::{Image, Op};
use crate::layout::{BlockShape, STRIP};

/// Rows whose sums stand on the stack at once.
pub(crate) const RUN: usize = 8 * STRIP;

/// A kind of work, with all that its price depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Work<'w> {
    /// Coming to an operation, at its start or in its midst.
    Enter(&'w Op<'w>),
    /// Elements of an operation, or units of a norm.
    Elements(&'w Op<'w>),
    /// Finding the scale of an input of so many values.
    Magnitude(usize),
    /// Setting outputs up before rows are added to them.
    Start(OutputStart),
    /// Preparing an input for blocks of this shape.
    Prepare(BlockShape),
    /// Strips of eight of a block's rows, whose outputs are `in_order`, or by an index, and `start` from the biases.
    Strips { shape: BlockShape, in_order: bool, start: bool },
    /// The way from the network's output to the action.
    Act(&'w Image<'w>),
}

/// What outputs are set to before rows are added to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputStart {
    /// To 0.
    Zero,
    /// To the biases.
    Bias,
    /// To themselves.
    Kept,
    /// To themselves and the biases.
    Added,
}

impl OutputStart {
    /// Of an operation that accumulates or not, with biases or without.
    pub(crate) const fn of(accumulate: bool, bias: bool) -> Self {
        match (accumulate, bias) {
            (false, false) => Self::Zero,
            (false, true) => Self::Bias,
            (true, false) => Self::Kept,
            (true, true) => Self::Added,
        }
    }
}

/// Says how far a piece of work may go.
pub(crate) trait Meter {
    /// Takes as many of `units` as there is room for, and says how many those are.
    fn take(&mut self, units: usize, work: Work<'_>) -> usize;
}

/// No limit. Where steps are not cut, no code asks for a price, and the cost model is not in the program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unlimited;

impl Meter for Unlimited {
    #[inline(always)]
    fn take(&mut self, units: usize, _: Work<'_>) -> usize {
        units
    }
}
