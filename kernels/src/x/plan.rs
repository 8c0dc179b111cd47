//! How a vector is prepared: all lengths of it.

use crate::layout::{Block, BlockShape, Lanes, Layout, PAD_COLS, PAIRED_GROUP, div_down, div_up, round_up};

/// How a vector is prepared for blocks of a shape, and what their kernels are given with it. Groups and chunks are
/// whole: zeros fill them.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The shape; its rows do not matter.
    pub(crate) shape: BlockShape,
    pub(crate) layout: &'static Layout,
    /// Columns with the padding.
    pub(crate) padded: usize,
    /// Groups; 1 where the weights have no group scales.
    pub(crate) groups: usize,
    /// Chunks of a group.
    pub(crate) chunks: usize,
    /// Columns of a group's first chunk; the others have [`XLayout::chunk`](crate::layout::XLayout::chunk).
    pub(crate) first: usize,
    /// Words of the prepared vector.
    pub(super) words: usize,
    #[cfg_attr(not(any(feature = "writer", actq_armv7em)), expect(dead_code, reason = "only the assembler reads it"))]
    arguments: KernelArguments,
}

/// The arguments of a kernel in assembler that depend on the vector's lengths. Kept with the plan, because it takes
/// longer to find than a call may.
#[cfg_attr(not(any(feature = "writer", actq_armv7em)), expect(dead_code, reason = "only the assembler reads it"))]
#[derive(Clone, Copy, Debug)]
pub struct KernelArguments {
    /// The words up to where it stops reading. Single lanes read no more than the block's own units; with row scales,
    /// the vector's sum stands behind the end, and behind a last group without a partner the pair's word.
    pub end: usize,
    /// Where chunks are summed without being taken apart, minus the biases of all of them; for single lanes with row
    /// scales 0; else the bytes of a group's first chunk.
    pub extra: usize,
    /// Steps that the first pass through the loop of a kernel for row scales leaves out, or the last pair of groups.
    pub skip: usize,
}

impl Plan {
    /// The plan for blocks of this shape, whose rows do not matter; `None` where it is not valid.
    pub const fn new(shape: BlockShape) -> Option<Self> {
        if shape.is_valid() { Some(Self::of_valid(shape)) } else { None }
    }

    /// The plan for a block.
    pub fn of(block: &Block<'_>) -> Self {
        Self::of_valid(block.shape())
    }

    /// Every call of a kernel comes through here; all lengths but the vector's are powers of two, so nothing is
    /// divided.
    #[inline(never)]
    const fn of_valid(shape: BlockShape) -> Self {
        let layout = shape.layout();
        let format = &layout.x;
        let (read, padded, group, groups, run) = if shape.group == 0 {
            let read = round_up(shape.cols, layout.step);
            let padded = round_up(read, layout.pad);
            (read, padded, padded, 1, format.run)
        } else {
            let read = round_up(shape.cols, shape.step(layout));
            // Two groups where they are taken in pairs.
            let group = shape.group << format.pairs as u32;
            let padded = round_up(read, group);
            (read, padded, group, div_down(padded, group), format.run << format.pairs as u32)
        };
        let before = (group - 1) >> layout.chunk_log;
        let (chunks, first) = (before + 1, group - (before << layout.chunk_log));
        let starts = format.start_words;
        let words = padded / 2 + groups * (chunks * starts + format.sum as usize);
        Self {
            shape,
            layout,
            padded,
            groups,
            chunks,
            first,
            words,
            arguments: KernelArguments {
                end: words - (padded - read) / 2 - (format.sum && shape.group == 0) as usize,
                extra: match shape.lanes {
                    _ if format.sum => 0usize.wrapping_sub(chunks * format.starts[0].bias as usize),
                    Lanes::Single if shape.group == 0 => 0,
                    _ => 4 * starts + 2 * first,
                },
                // Passes and steps are powers of two, and chunks that are longer than a pass are whole passes.
                skip: (0usize.wrapping_sub(read) & (run - 1)) >> layout.step_log,
            },
        }
    }

    /// Whether what is prepared by this plan is for blocks of this shape.
    #[inline(always)]
    pub fn fits(&self, shape: BlockShape) -> bool {
        let BlockShape { width, lanes, rows: _, cols, group } = self.shape;
        (width, lanes, cols, group) == (shape.width, shape.lanes, shape.cols, shape.group)
    }

    /// Words of the prepared vector.
    #[cfg(feature = "writer")]
    pub const fn words(&self) -> usize {
        self.words
    }

    /// Words that preparing a vector of `len` values needs. A vector that does not fill its groups is copied first and
    /// filled up with zeros: to the end of the room, while the prepared words grow from its begin.
    pub const fn room(&self, len: usize) -> usize {
        if len == self.padded { self.words } else { self.words + self.padded / 2 }
    }

    /// What a kernel in assembler is given with the vector.
    #[inline(always)]
    #[cfg(any(feature = "writer", actq_armv7em))]
    pub const fn arguments(&self) -> KernelArguments {
        self.arguments
    }

    /// Columns of a group.
    #[cfg(any(feature = "writer", not(actq_fpu)))]
    const fn group(&self) -> usize {
        self.first + (self.chunks - 1) * self.layout.x.chunk
    }

    /// Words of a group.
    #[cfg(any(feature = "writer", not(actq_fpu)))]
    pub(super) const fn group_words(&self) -> usize {
        self.group() / 2 + self.chunks * self.layout.x.start_words + self.layout.x.sum as usize
    }

    /// Words of a chunk of so many columns.
    #[cfg(any(feature = "writer", not(actq_fpu)))]
    pub(super) const fn chunk_words(&self, columns: usize) -> usize {
        self.layout.x.start_words + columns / 2
    }

    /// Words before the pair of column `col`.
    #[cfg(feature = "writer")]
    pub(super) const fn words_before(&self, col: usize) -> usize {
        let (group, col) = (col / self.group(), col % self.group());
        let full_before = (col + self.layout.x.chunk - self.first) / self.layout.x.chunk;
        group * self.group_words() + (full_before + 1) * self.layout.x.start_words + col / 2
    }

    /// What the cost of preparing and of reading a vector depends on.
    pub(crate) const fn extent(&self) -> Extent {
        let passes = match (self.shape.group, self.layout.x.run) {
            (0, 1) => 0,
            (0, run) => div_up(self.padded, run),
            _ => self.groups,
        };
        Extent { columns: self.padded, groups: self.groups, chunks: self.groups * self.chunks, passes }
    }
}

/// See [`Plan::extent`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extent {
    /// Columns with the padding.
    pub(crate) columns: usize,
    /// Groups; 1 where the weights have no group scales.
    pub(crate) groups: usize,
    /// Chunks of all groups.
    pub(crate) chunks: usize,
    /// Passes through a kernel's loop that are more than a step of its columns: groups, or runs of a row.
    pub(crate) passes: usize,
}

/// Words that suffice to prepare a vector for blocks of any layout that has such groups: the most that [`Plan::room`]
/// gives. That is with chunks of eight columns and a sum, or where single lanes or pairs of groups need more columns.
pub const fn max_prepared_words(cols: usize, group: usize) -> usize {
    // Pairs of the columns up to a multiple of `unit`, and of a copy, where that has more columns.
    const fn pairs(cols: usize, unit: usize) -> usize {
        let padded = round_up(cols, unit);
        if padded == cols { padded / 2 } else { padded }
    }
    if group == 0 {
        let (single, paired) = (pairs(cols, PAD_COLS), pairs(cols, 8) + div_up(cols, 8));
        return 1 + if single > paired { single } else { paired };
    }
    let others = if group == PAIRED_GROUP { 5 } else { 1 };
    let words = pairs(cols, group) + div_up(cols, group) * others;
    // Groups in pairs: two start words and the word of the sums.
    let in_pairs = if group == PAIRED_GROUP { pairs(cols, 2 * group) + div_up(cols, 2 * group) * 3 } else { 0 };
    if words > in_pairs { words } else { in_pairs }
}
