//! The memory during a long product, which is most of a step's time: with the feature `checksums`, a bit that flips
//! meanwhile ends the step.
//!
//! Three checksums cover it: of the words that the product does not write (values that later operations add, the
//! recurrent state, a chunk), of its prepared input unless that is for few rows, and of its finished rows. After it is
//! prepared, its input itself is not covered: few networks need it again, as those with a sum of a layer's input and output
//! without a norm.

use crate::checksum::{Checksum, WEIGHTS, xor};
use crate::cursor::Cursor;
use crate::error::Fault;
use crate::image::{Image, Op, OpKind, Region};
use crate::meter::{Meter, Work};
use crate::ops::run;

/// The words to watch during a product, besides its prepared input and its finished rows.
#[derive(Clone, Copy)]
pub(crate) struct Watched {
    /// Words of scratch memory.
    scratch: usize,
    /// Outputs, input and work area: all words but those to watch.
    others: [Region; 3],
}

impl Watched {
    /// Returns `true` for a product, if the build watches any. (Not a part of [`Self::of`], whose result a caller would copy.)
    #[inline(always)]
    pub(crate) fn may_be(op: &Op<'_>) -> bool {
        cfg!(feature = "checksums") && matches!(op.kind, OpKind::Linear { .. })
    }

    /// Returns the words to watch during a product; `None` if it is too short even for its own values.
    #[inline(never)]
    pub(crate) fn of(image: &Image<'_>, op: &Op<'_>) -> Option<Self> {
        let (rows, cols, scratch) = (op.dst().len, op.src().len, image.scratch_words());
        // Two prepared values in a word.
        let (own, most) = (rows + cols / 2, rows * cols / WEIGHTS);
        if own > most {
            return None;
        }
        let mut others = op.regions;
        if op.linear_matrix().ok()?.block_count() > 1 {
            // Blocks of another width prepare the input again.
            others[1] = Region::default();
        }
        let quiet = others.iter().fold(scratch, |words, region| words.saturating_sub(region.len));
        if own + quiet > most {
            // Too many words for the product: all are others.
            others[0] = Region { offset: 0, len: scratch };
        }
        Some(Self { scratch, others })
    }

    /// Returns the work of the checksum.
    pub(crate) fn work(&self) -> Work<'static> {
        Checksum::work(self.scratch)
    }

    #[inline(never)]
    fn sum(&self, arena: &[u32]) -> u32 {
        let (mut sum, mut from) = (0, 0);
        while from < self.scratch {
            let [mut end, mut after] = [self.scratch; 2];
            for region in &self.others {
                if region.len > 0 && region.end() > from && region.offset < end {
                    (end, after) = (region.offset.max(from), region.end());
                }
            }
            sum ^= xor(arena.get(from..end).unwrap_or_default());
            from = after;
        }
        sum
    }
}

/// Does the same as [`run`], and watches the memory.
#[inline(always)]
pub(super) fn run_watched(
    image: &Image<'_>,
    op: &Op<'_>,
    arena: &mut [u32],
    cursor: &mut Cursor,
    budget: &mut impl Meter,
) -> Result<bool, Fault> {
    let watched = if Watched::may_be(op) { Watched::of(image, op) } else { None };
    let Some(watched) = watched else { return run(op, arena, cursor, budget) };
    if !cursor.linear.quiet.is_set() {
        if budget.take(1, watched.work()) == 0 {
            return Ok(false);
        }
        cursor.linear.quiet = Checksum::of(|| watched.sum(arena));
    }
    if !run(op, arena, cursor, budget)? || budget.take(1, watched.work()) == 0 {
        return Ok(false);
    }
    let linear = &cursor.linear;
    linear.rows.check(|| {
        let rows = arena.get(op.dst().range()).and_then(|rows| rows.get(..linear.started));
        xor(rows.unwrap_or_default())
    })?;
    linear.quiet.check(|| watched.sum(arena))?;
    Ok(true)
}
