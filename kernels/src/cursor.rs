//! Where a step in pieces stands.

use crate::layout::Width;
use crate::x::Scale;

/// Where an evaluation stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cursor {
    /// The operation.
    pub(crate) op: usize,
    /// The denoising step that it belongs to.
    pub(crate) step: usize,
    /// Seed and draw of the noise; `None` where the caller has given it.
    pub(crate) draw: Option<[u32; 2]>,
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
        self.op != begin.op || self.step > 0 || self.done > 0 || self.linear.scale.is_some()
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
    /// The output of the last of them, where the block's rows have steps.
    pub(crate) output: usize,
}

/// What a norm has summed so far: a piece of it goes on where the last one ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    pub(crate) sum: f32,
    /// Of the squares of the differences from the mean.
    pub(crate) squares: f32,
}
