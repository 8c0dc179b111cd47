//! What the pieces of a step cost, and what a poll may spend.
//!
//! A piece is a run of units of one kind of work: strips of rows of a matrix, outputs set to their biases, elements of
//! a function, of a cell, of a copy. Preparing a matrix's input is two pieces, its scale and its integers: neither
//! takes longer than a strip of the rows that it is prepared for.

use super::cost::{self, Feature};
use crate::image::{Image, Op, OpKind, RowBlock};
use crate::meter::{Meter, OutputStart, Work};

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
struct Price {
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

    /// Of a kind of work.
    fn of(work: Work<'_>) -> Self {
        match work {
            // No piece of its own: what a piece takes is the price of what follows.
            Work::Enter(op) => Self { first: 0, each: parts(cost::most(|add| cost::enter(op, add))) },
            // A unit of a norm takes less than an element in all passes.
            Work::Elements(op) => {
                Self::new(cost::most(|add| cost::piece(op, add)), cost::most(|add| cost::dearest_element(op, add)))
            }
            Work::Magnitude(cols) => Self::new(cost::most(|add| cost::magnitude(cols, add)), 0),
            Work::Start(start) => Self::new(Feature::BIASED.most(), cost::most(|add| cost::start(start, 1, add))),
            Work::Prepare(shape) => Self::new(cost::most(|add| cost::prepare(shape, add)), 0),
            Work::Strips { shape, in_order, start } => {
                let (first, each) = cost::strips(shape, in_order, start);
                Self::new(first, each)
            }
            Work::Act(image) => Self::new(cost::most(|add| cost::action(image, add)), 0),
        }
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
}

impl Meter for Budget {
    #[inline(always)]
    fn take(&mut self, units: usize, work: Work<'_>) -> usize {
        if self.left == u32::MAX { units } else { self.take_priced(units, Price::of(work)) }
    }
}

/// Of a poll, without its pieces.
fn poll() -> u32 {
    parts(Feature::POLL.most())
}

/// Of the shortest piece of a kind of work.
fn least(work: Work<'_>) -> u32 {
    let Price { first, each } = Price::of(work);
    first.saturating_add(each)
}

impl Image<'_> {
    /// The least budget, in modelled instructions, with which [`crate::Head::poll`] runs the image.
    pub fn least_budget(&self) -> u32 {
        let of_op = |op: Op<'_>| -> u32 {
            let piece = match (op.kind, op.matrix()) {
                (OpKind::Linear { accumulate }, Some(matrix)) => {
                    let start = matrix.start_values(accumulate).is_some();
                    let of_block = |rows: RowBlock<'_>| {
                        let (shape, in_order) = (rows.block.shape(), rows.steps.is_empty());
                        least(Work::Prepare(shape)).max(least(Work::Strips { shape, in_order, start }))
                    };
                    let bias = Work::Start(OutputStart::of(accumulate, !matrix.bias.is_empty()));
                    let first = least(Work::Magnitude(matrix.cols)).max(if start { 0 } else { least(bias) });
                    matrix.blocks().map(of_block).fold(first, u32::max)
                }
                _ => least(Work::Elements(&op)),
            };
            piece.saturating_add(least(Work::Enter(&op)))
        };
        let pieces = self.ops().map(of_op).fold(least(Work::Act(self)), u32::max);
        pieces.saturating_add(poll()).div_ceil(PARTS)
    }
}
