//! The cost of the pieces of a slice, and the budget of a poll.
//!
//! A piece is successive units of one kind of work: strips of rows of a matrix, outputs set to their biases, elements
//! of a function, of a recurrent cell, of a copy. Preparing a matrix's input is two pieces, its scale and its integers:
//! neither takes longer than a strip of the rows that it is prepared for.

use super::CostItem;
use crate::checksum::Checksum;
use crate::cost;
use crate::head::Watched;
use crate::image::{Image, Op, OpKind, RowBlock};
use crate::layout::STRIP;
use crate::meter::{Meter, OutputStart, Work};

/// Parts of an instruction in which budgets count, so that rounding up elements of a few instructions costs little.
const PARTS: u32 = 16;

/// Margin of every piece for the error of the rates: this fraction of it is added.
const MARGIN: u32 = 32;

/// Converts 1024ths of an instruction to parts of a budget, rounded up, with the margin.
const fn parts(cost: u32) -> u32 {
    let parts = cost / (1024 / PARTS) + 1;
    parts.saturating_add(parts / MARGIN)
}

/// Returns the most that a checksum costs, in 1024ths of an instruction; 0 in a build without.
#[inline(always)]
fn checksum(words: usize) -> u32 {
    if cfg!(feature = "checksums") { magnitude(Checksum::values(words)) } else { 0 }
}

/// Returns the most that the largest of values costs, in 1024ths of an instruction.
#[inline(never)]
fn magnitude(values: usize) -> u32 {
    cost::most(|add| cost::magnitude(values, add))
}

/// Cost of a piece, in parts of a budget.
#[derive(Clone, Copy, Debug)]
struct PieceCost {
    /// Cost of the piece at any length.
    first: u32,
    /// Cost of each unit.
    each: u32,
}

impl PieceCost {
    /// Converts costs in 1024ths of an instruction.
    fn new(first: u32, each: u32) -> Self {
        let first = first.saturating_add(CostItem::PIECE.most());
        Self { first: parts(first), each: parts(each) }
    }

    /// Returns the cost of a kind of work.
    fn of(work: Work<'_>) -> Self {
        match work {
            // Not a piece of its own: the cost of a piece is in the work that follows.
            Work::Enter(op) => Self { first: 0, each: parts(cost::most(|add| cost::enter(op, add))) },
            // A unit of a norm takes less than an element in all passes.
            Work::Elements(op) => Self::new(
                cost::most(|add| cost::piece(op, add)),
                cost::most(|add| cost::most_expensive_element(op, add)),
            ),
            Work::Magnitude(values) => Self::new(magnitude(values), 0),
            Work::Start(start) => Self::new(CostItem::BIASED.most(), cost::most(|add| cost::start(start, 1, add))),
            Work::Prepare(shape) => {
                Self::new(cost::most(|add| cost::prepare(shape, add)).saturating_add(checksum(shape.cols / 2)), 0)
            }
            Work::Strips { shape, in_order, start } => {
                let (first, each) = cost::strips(shape, in_order, start);
                Self::new(first, each.saturating_add(checksum(STRIP)))
            }
            Work::Act(image) => {
                // At most all words are saved between steps.
                let saved = checksum(image.scratch_words());
                Self::new(cost::most(|add| cost::action(image, add)).saturating_add(saved), 0)
            }
        }
    }
}

/// Remaining budget of a poll.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    left: u32,
}

impl Budget {
    const UNLIMITED: Self = Self { left: u32::MAX };

    /// Returns the budget of a poll with `instructions`, minus the cost of the poll itself.
    pub(crate) fn of_poll(instructions: u32) -> Self {
        match instructions.checked_mul(PARTS) {
            Some(parts) => Self { left: parts.saturating_sub(poll()) },
            None => Self::UNLIMITED,
        }
    }

    #[inline(never)]
    fn take_priced(&mut self, units: usize, PieceCost { first, each }: PieceCost) -> usize {
        let Some(room) = self.left.checked_sub(first) else { return 0 };
        // A piece without a price fits any room. (A plain division would keep a panic in programs without LTO.)
        let units = units.min(room.checked_div(each).unwrap_or(u32::MAX) as usize);
        if units > 0 {
            self.left = room - each * units as u32;
        }
        units
    }
}

impl Meter for Budget {
    #[inline(always)]
    fn take(&mut self, units: usize, work: Work<'_>) -> usize {
        if self.is_limited() { self.take_priced(units, PieceCost::of(work)) } else { units }
    }

    #[inline(always)]
    fn is_limited(&self) -> bool {
        self.left != u32::MAX
    }
}

/// Returns the cost of a poll without its pieces.
fn poll() -> u32 {
    parts(CostItem::POLL.most())
}

/// Returns the cost of the shortest piece of a kind of work.
fn least(work: Work<'_>) -> u32 {
    let PieceCost { first, each } = PieceCost::of(work);
    first.saturating_add(each)
}

impl Image<'_> {
    /// Computes the least budget with which [`crate::Head::poll`] runs the image, in modelled instructions.
    pub fn least_budget(&self) -> u32 {
        let of_op = |op: Op<'_>| -> u32 {
            let piece = match (op.kind, op.matrix()) {
                (OpKind::Linear { accumulate, .. }, Some(matrix)) => {
                    let start = matrix.start_values(accumulate).is_some();
                    let of_block = |rows: RowBlock<'_>| {
                        let (shape, in_order) = (rows.block.shape(), rows.steps.is_empty());
                        least(Work::Prepare(shape)).max(least(Work::Strips { shape, in_order, start }))
                    };
                    let bias = Work::Start(OutputStart::of(accumulate, !matrix.bias.is_empty()));
                    let first = least(Work::Magnitude(matrix.cols)).max(if start { 0 } else { least(bias) });
                    let watched = if Watched::may_be(&op) { Watched::of(self, &op) } else { None };
                    let first = first.max(watched.map_or(0, |watched| least(watched.work())));
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
