//! The GEMV, and the one place that chooses its backend.

use crate::activations::Prepared;
use crate::format::{Block, QUAD};

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

/// The block and the prepared vector do not belong together: other columns or another group size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch;

/// Multiplies quads of a block's rows with a prepared vector.
///
/// `acc[q][r]` becomes `sum over groups of scale * sum over columns of level * x`, modulo 2^32, for row
/// `4 * (first_quad + q) + r`. The sums of padding rows have no meaning. As many quads are computed as both `acc` and the
/// block hold; the rest of `acc` is left as it was.
///
/// The true sum fits an i32 where [`crate::linear::worst_case`] says so, which [`crate::Image::new_checked`] has verified.
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_quad: usize, acc: &mut [[i32; QUAD]]) -> Result<(), Mismatch> {
    if block.shape().cols != x.cols || block.shape().group != x.group {
        return Err(Mismatch);
    }
    #[cfg(actq_armv7em)]
    crate::armv7em::gemv(block, x, first_quad, acc);
    #[cfg(not(actq_armv7em))]
    crate::portable::gemv(block, x, first_quad, acc);
    Ok(())
}
