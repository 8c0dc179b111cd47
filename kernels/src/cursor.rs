//! Progress of a step that runs in slices.

use crate::activations::Scale;
use crate::checksum::{Checksum, WEIGHTS, xor};
use crate::layout::{BlockShape, Width};

/// Progress of an evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cursor {
    /// Index of the operation.
    pub(crate) op: usize,
    /// Denoising step of the operation.
    pub(crate) step: usize,
    /// Seed and draw of the noise; `None` if the caller provides the noise.
    pub(crate) draw: Option<[u32; 2]>,
    /// Finished elements of the operation, or units of a norm.
    pub(crate) done: usize,
    /// Sums of a norm.
    pub(crate) moments: Moments,
    /// Progress of a linear operation.
    pub(crate) linear: LinearCursor,
}

impl Cursor {
    /// Returns `true` if work has been done since `begin`, the start of an operation.
    pub(crate) fn has_progressed(&self, begin: Self) -> bool {
        // A linear operation begins with its scale.
        self.op != begin.op || self.step > 0 || self.done > 0 || self.linear.scale.is_some()
    }
}

/// Progress of a linear operation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LinearCursor {
    /// Scale of the input, if known.
    pub(crate) scale: Option<Scale>,
    /// Initialized outputs, if outputs are initialized before the rows; else the rows in the checksum `rows`.
    pub(crate) started: usize,
    /// Finished blocks.
    pub(crate) block: usize,
    /// Width that the input is prepared for.
    pub(crate) prepared: Option<Width>,
    /// Finished rows of the block.
    pub(crate) row: usize,
    /// Output of the last finished row, if the block has output steps.
    pub(crate) output: usize,
    /// Checksums of the arena that the operation does not write, of the prepared input, and of the finished rows; only
    /// of a long product.
    pub(crate) quiet: Checksum,
    pub(crate) input: Checksum,
    pub(crate) rows: Checksum,
}

impl LinearCursor {
    /// Records that the input was prepared for blocks of this shape.
    pub(crate) fn has_prepared(&mut self, shape: BlockShape, prepared: &[u32]) {
        self.prepared = Some(shape.width);
        // Not for a few rows: a checksum of half a word for each column.
        let watched = self.quiet.is_set() && shape.rows >= WEIGHTS / 2;
        self.input = if watched { Checksum::of(|| xor(prepared)) } else { Checksum::default() };
    }
}

/// Partial sums of a norm: a slice continues the sums of the previous one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    /// Sum of the elements.
    pub(crate) sum: f32,
    /// Sum of the squared differences from the mean.
    pub(crate) squares: f32,
}
