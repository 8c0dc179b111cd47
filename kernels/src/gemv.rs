//! The GEMV, and the one place that chooses its backend.

use crate::activations::Prepared;
use crate::format::{Block, STRIP};

/// A backend that can be compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// [`crate::portable`].
    Portable,
    /// `crate::armv7em`: assembler for Cortex-M4 and M7.
    Armv7em,
}

/// The backend that [`gemv`] uses in this build.
pub const BACKEND: Backend = if cfg!(actq_armv7em) { Backend::Armv7em } else { Backend::Portable };

/// The block and the prepared vector do not belong together (other columns, another group size or layout), or the rows are
/// no whole strips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch;

/// Multiplies a run of a block's rows with a prepared vector.
///
/// `acc[i]` becomes `sum over groups of scale * sum over columns of level * x`, modulo 2^32, for row `first_row + i`. The run
/// starts at a multiple of [`STRIP`]; it ends at another or where the block does, padded to a multiple of
/// [`crate::format::QUAD`] rows. The sums of padding rows have no meaning.
///
/// The true sum fits an i32 where [`crate::linear::worst_case`] says so, which [`crate::Image::new_checked`] has verified.
#[inline(never)]
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) -> Result<(), Mismatch> {
    let shape = block.shape();
    let Some(left) = shape.padded_rows().checked_sub(first_row) else { return Err(Mismatch) };
    let ends_well = acc.len() == left || acc.len() < left && acc.len().is_multiple_of(STRIP);
    if !first_row.is_multiple_of(STRIP) || !ends_well {
        return Err(Mismatch);
    }
    #[cfg(actq_armv7em)]
    return crate::armv7em::gemv(block, x, first_row, acc);
    #[cfg(not(actq_armv7em))]
    x.plan().fits(shape).then(|| crate::portable::gemv(block, x, first_row, acc)).ok_or(Mismatch)
}
