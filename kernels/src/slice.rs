//! A step in pieces: what a poll may spend, and where the evaluation stands.
//!
//! A piece is a run of units of one kind of work: strips of rows of a matrix, outputs set to their biases, elements of a
//! function, of a cell, of a copy. Preparing a matrix's input is two pieces, its scale and its integers: neither takes longer
//! than a strip of the rows that it is prepared for.

use crate::cost::{self, Feature};
use crate::image::{Image, Op, OpKind};
use crate::layout::Width;
use crate::linear::{Matrix, RowBlock};
use crate::norm::Moments;
use crate::x::Scale;

/// Budgets are kept in 16ths of an instruction, so that elements of a few instructions are not rounded up by much.
const PARTS: u32 = 16;

/// What is added to every piece for what the rates cannot say exactly, as a share of it.
const MARGIN: u32 = 32;

/// 1024ths of an instruction as parts of a budget, rounded up, with the margin.
const fn parts(cost: u32) -> u32 {
    let parts = cost / (1024 / PARTS) + 1;
    parts.saturating_add(parts / MARGIN)
}

/// The price of a piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Price {
    /// Of the piece, whatever its length.
    first: u32,
    /// Of a unit.
    each: u32,
}

impl Price {
    /// From 1024ths of an instruction.
    fn new(first: u32, each: u32) -> Self {
        let first = first.saturating_add(Feature::PIECE.most());
        Self { first: parts(first), each: parts(each) }
    }

    /// Of the shortest piece.
    fn least(self) -> u32 {
        self.first.saturating_add(self.each)
    }

    /// Of an operation's units. A unit of a norm takes less than an element in all passes; each of its pieces computes anew what
    /// the sums give.
    pub(crate) fn units(op: &Op<'_>) -> Self {
        let (operation, value, _) = cost::values(op);
        Self::new(if op.units() == op.dst().len { 0 } else { operation.most() }, value.most())
    }

    /// Of finding the scale of a matrix's input.
    pub(crate) fn magnitude(matrix: &Matrix<'_>) -> Self {
        Self::new(cost::most(|add| cost::magnitude(matrix.cols, add)), 0)
    }

    /// Of setting outputs to their biases. To add biases to what is there takes a little more than to set them, and less than
    /// twice as much; the quantizer makes no such operation, so that it is not measured.
    pub(crate) fn bias(accumulate: bool) -> Self {
        let each = if accumulate { 2 * Feature::BIAS.most() } else { Feature::BIAS.most() + Feature::ZEROED.most() };
        Self::new(Feature::BIASED.most(), each)
    }

    /// Of preparing a matrix's input for a block.
    pub(crate) fn prepare(rows: &RowBlock<'_>) -> Self {
        Self::new(cost::most(|add| cost::prepare(rows.block.shape(), add)), 0)
    }

    /// Of a block's strips.
    pub(crate) fn strips(rows: &RowBlock<'_>, start: bool) -> Self {
        let (first, each) = cost::strips(rows, start);
        Self::new(first, each)
    }

    /// Of the way from the network's output to the action.
    pub(crate) fn action(image: &Image<'_>) -> Self {
        Self::new(cost::most(|add| cost::action(image, add)), 0)
    }
}

/// Says how far a piece of work may go.
pub(crate) trait Meter {
    /// Takes as many of `units` as there is room for, and says how many those are.
    fn take(&mut self, units: usize, price: impl FnOnce() -> Price) -> usize;

    /// Takes the price of coming to an operation, at its start or in its midst; false where it does not fit.
    fn enter(&mut self, op: &Op<'_>) -> bool;
}

/// No limit. Where steps are not cut, no code asks for a price, and the cost model is not in the program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unlimited;

impl Meter for Unlimited {
    #[inline(always)]
    fn take(&mut self, units: usize, _: impl FnOnce() -> Price) -> usize {
        units
    }

    #[inline(always)]
    fn enter(&mut self, _: &Op<'_>) -> bool {
        true
    }
}

/// What may still be spent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    left: u32,
}

impl Budget {
    const UNLIMITED: Self = Self { left: u32::MAX };

    /// The budget of a poll with `instructions`, of which the poll itself takes a part.
    pub(crate) fn of_poll(instructions: u32) -> Self {
        match instructions.checked_mul(PARTS) {
            Some(parts) => Self { left: parts.saturating_sub(poll()) },
            None => Self::UNLIMITED,
        }
    }

    #[inline(never)]
    fn take_priced(&mut self, units: usize, Price { first, each }: Price) -> usize {
        let Some(room) = self.left.checked_sub(first) else { return 0 };
        let units = units.min((room / each) as usize);
        if units > 0 {
            self.left = room - each * units as u32;
        }
        units
    }

    #[inline(never)]
    fn pay(&mut self, price: u32) -> bool {
        let left = self.left.checked_sub(price);
        self.left = left.unwrap_or(0);
        left.is_some()
    }
}

impl Meter for Budget {
    #[inline(always)]
    fn take(&mut self, units: usize, price: impl FnOnce() -> Price) -> usize {
        if self.left == u32::MAX { units } else { self.take_priced(units, price()) }
    }

    #[inline(always)]
    fn enter(&mut self, op: &Op<'_>) -> bool {
        self.left == u32::MAX || self.pay(entrance(op))
    }
}

/// Of a poll, without its pieces.
fn poll() -> u32 {
    parts(Feature::POLL.most())
}

/// Of coming to an operation.
fn entrance(op: &Op<'_>) -> u32 {
    parts(cost::most(|add| cost::enter(op, add)))
}

/// The least budget with which every poll gets on.
pub(crate) fn least_budget(image: &Image<'_>) -> u32 {
    let of_op = |op: Op<'_>| -> u32 {
        let piece = match (op.kind, op.matrix()) {
            (OpKind::Linear { accumulate }, Some(matrix)) => {
                let start = matrix.start_values(accumulate).is_some();
                let blocks = matrix.blocks();
                let block = blocks.map(|r| Price::prepare(&r).least().max(Price::strips(&r, start).least()));
                let bias = if start { 0 } else { Price::bias(accumulate).least() };
                block.fold(bias.max(Price::magnitude(&matrix).least()), u32::max)
            }
            _ => Price::units(&op).least(),
        };
        piece.saturating_add(entrance(&op))
    };
    let pieces = image.ops().map(of_op).fold(Price::action(image).least(), u32::max);
    pieces.saturating_add(poll()).div_ceil(PARTS)
}

/// Where an evaluation stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cursor {
    /// The operation.
    pub(crate) op: usize,
    /// Its elements that are done, or units of a norm.
    pub(crate) done: usize,
    /// Of a norm.
    pub(crate) moments: Moments,
    /// Of a linear operation.
    pub(crate) linear: LinearCursor,
}

impl Cursor {
    /// Whether work has been done since `begin`, the start of an operation.
    pub(crate) fn has_left(&self, begin: Self) -> bool {
        // A linear operation begins with its scale.
        self.op != begin.op || self.done > 0 || self.linear.scale.is_some()
    }
}

/// Where a linear operation stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinearCursor {
    /// The scale of its input, once that is known.
    pub(crate) scale: Option<Scale>,
    /// Outputs that have their biases, where these come first.
    pub(crate) started: usize,
    /// Blocks that are done.
    pub(crate) block: usize,
    /// The width that the input is prepared for.
    pub(crate) prepared: Option<Width>,
    /// Rows of the block that are done.
    pub(crate) row: usize,
}
