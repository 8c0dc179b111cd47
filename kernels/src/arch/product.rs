//! What a GEMV is given.

use core::fmt;

use crate::layout::{Block, STRIP};
use crate::x::Prepared;

/// The block and the prepared vector do not belong together (other columns, another group size or layout), or the rows
/// are no whole strips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mismatch;

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("block and prepared vector do not belong together, or the rows are no whole strips")
    }
}

impl core::error::Error for Mismatch {}

/// A run of a block's rows, a vector that was prepared for its shape, and room for the sums. All of it fits, so that no
/// backend can fail.
#[derive(Debug)]
pub struct Product<'a> {
    pub(super) block: &'a Block<'a>,
    pub(super) x: &'a Prepared<'a>,
    pub(super) first_row: usize,
    pub(super) acc: &'a mut [i32],
}

impl<'a> Product<'a> {
    /// As many rows as `acc` has values. The run starts at a multiple of [`STRIP`]; it ends at another or where the
    /// block does, padded to a multiple of [`QUAD`](crate::layout::QUAD) rows.
    #[inline(always)]
    pub fn new(
        block: &'a Block<'a>,
        x: &'a Prepared<'a>,
        first_row: usize,
        acc: &'a mut [i32],
    ) -> Result<Self, Mismatch> {
        let shape = block.shape();
        let Some(left) = shape.padded_rows().checked_sub(first_row) else { return Err(Mismatch) };
        let ends_well = acc.len() == left || acc.len() < left && acc.len().is_multiple_of(STRIP);
        if !first_row.is_multiple_of(STRIP) || !ends_well || !x.plan().fits(shape) {
            return Err(Mismatch);
        }
        Ok(Self { block, x, first_row, acc })
    }
}
