//! The operands of a GEMV.

use core::fmt;

use super::tables::Tables;
use crate::activations::Prepared;
use crate::layout::{Block, STRIP};

/// The block and the prepared vector differ in columns, group size or layout, the rows are not whole strips, or a slice
/// is too short.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mismatch;

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("block, prepared vector and slices do not fit each other, or the rows are not whole strips")
    }
}

impl core::error::Error for Mismatch {}

/// Successive rows of a block, a vector that was prepared for its shape, and room for the sums. All of them fit each
/// other, so that no backend can fail.
#[derive(Debug)]
pub struct Product<'a> {
    pub(super) block: &'a Block<'a>,
    pub(super) x: &'a Prepared<'a>,
    pub(super) first_row: usize,
    pub(super) acc: &'a mut [i32],
    /// Nothing reads it in a build without the layouts that have tables.
    #[cfg_attr(not(feature = "scalar"), expect(dead_code))]
    pub(super) tables: Tables<'a>,
}

impl<'a> Product<'a> {
    /// Combines the operands for the rows from `first_row` on, as many as `acc` has values. They start at a multiple of
    /// [`STRIP`], and end at another or at the block's end, padded to a multiple of [`QUAD`](crate::layout::QUAD) rows.
    ///
    /// # Errors
    ///
    /// [`Mismatch`] if they do not fit each other.
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
        Ok(Self { block, x, first_row, acc, tables: Tables::default() })
    }
}
