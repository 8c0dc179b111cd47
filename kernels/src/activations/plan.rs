//! The plan of a prepared vector: all its lengths.

use crate::layout::{Block, BlockShape, Lanes, Layout, PAD_COLS, div_down, div_up, round_up};

/// The lengths of a vector that is prepared for blocks of a shape, and the kernels' arguments. Zeros fill groups and
/// chunks.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Shape of the blocks; its rows do not matter.
    pub(crate) shape: BlockShape,
    pub(crate) layout: &'static Layout,
    /// Columns with padding.
    pub(crate) padded: usize,
    /// Groups; 1 without group scales.
    pub(crate) groups: usize,
    /// Chunks of a group.
    pub(crate) chunks: usize,
    /// Columns of a group's first chunk; all others have [`XLayout::chunk`](crate::layout::XLayout::chunk).
    pub(crate) first: usize,
    /// Words of the prepared vector.
    pub(super) words: usize,
    arguments: KernelArguments,
}

/// Arguments of an assembler kernel that depend on the vector's lengths. The plan keeps them: a call has no time to
/// compute them.
#[derive(Clone, Copy, Debug)]
pub struct KernelArguments {
    /// Words that the kernel reads. Single lanes read no more than the block's own units. With row scales, the vector's
    /// sum follows the end; after a last group without a partner, the pair's word follows.
    pub end: usize,
    /// If chunks are summed without separation, minus the biases of all of them; 0 for single lanes with row scales;
    /// otherwise the bytes of a group's first chunk.
    pub extra: usize,
    /// Steps that the first pass through the loop of a kernel for row scales skips, or the last pair of groups.
    pub skip: usize,
}

impl Plan {
    /// Creates the plan for blocks of this shape, whose rows do not matter; `None` if the shape is not valid.
    pub const fn new(shape: BlockShape) -> Option<Self> {
        if shape.is_valid() { Some(Self::of_valid(shape)) } else { None }
    }

    /// Creates the plan for a block.
    pub fn of(block: &Block<'_>) -> Self {
        Self::of_valid(block.shape())
    }

    /// Creates the plan for a valid shape. Every call of a kernel needs it; all lengths except the vector's are powers
    /// of two, so there is no division.
    #[inline(never)]
    const fn of_valid(shape: BlockShape) -> Self {
        let layout = shape.layout();
        let format = &layout.x;
        let (read, padded, group, groups, run) = if !shape.has_groups() {
            let read = round_up(shape.cols, layout.step);
            let padded = round_up(read, layout.pad);
            (read, padded, padded, 1, format.run)
        } else {
            let read = round_up(shape.cols, shape.step(layout));
            // Two groups if the layout pairs them.
            let group = shape.group << format.pairs as u32;
            let padded = round_up(read, group);
            (read, padded, group, div_down(padded, group), format.run << format.pairs as u32)
        };
        let before = (group - 1) >> layout.chunk_log;
        let (chunks, first) = (before + 1, group - (before << layout.chunk_log));
        let starts = format.start_words;
        let words = format.words(padded) + groups * (chunks * starts + format.sum as usize);
        Self {
            shape,
            layout,
            padded,
            groups,
            chunks,
            first,
            words,
            arguments: KernelArguments {
                end: words - format.words(padded - read) - (format.sum && shape.group == 0) as usize,
                extra: match shape.lanes {
                    _ if format.sum => 0usize.wrapping_sub(chunks * format.starts[0].bias as usize),
                    Lanes::Single if shape.group == 0 => 0,
                    #[cfg(feature = "scalar")]
                    Lanes::Scalar => 0,
                    #[cfg(feature = "helium")]
                    Lanes::Helium => 0,
                    _ => 4 * starts + 2 * first,
                },
                // Passes and steps are powers of two, and a chunk that is longer than a pass is whole passes.
                skip: (0usize.wrapping_sub(read) & (run - 1)) >> layout.step_log,
            },
        }
    }

    /// Returns `true` if this plan is for blocks of this shape.
    #[inline(always)]
    pub fn fits(&self, shape: BlockShape) -> bool {
        let BlockShape { width, lanes, rows: _, cols, group } = self.shape;
        (width, lanes, cols, group) == (shape.width, shape.lanes, shape.cols, shape.group)
    }

    /// Returns the words of the prepared vector.
    pub const fn words(&self) -> usize {
        self.words
    }

    /// Returns the words that preparing a vector of `len` values needs. A vector that does not fill its groups is first
    /// copied to the end of these words and filled with zeros, while the prepared words grow from their start; bytes need
    /// no copy.
    pub const fn room(&self, len: usize) -> usize {
        let copies = len != self.padded && !self.layout.x.has_bytes();
        if copies { self.words + self.padded / 2 } else { self.words }
    }

    /// Returns `true` if a vector of the block's columns can be prepared in its own words: the prepared one is no longer, and
    /// no assembler of the DSP extension's layouts needs a copy, as it does to fill groups.
    pub const fn fits_in_place(&self) -> bool {
        let copies = self.shape.cols != self.padded && matches!(self.shape.lanes, Lanes::Single | Lanes::Paired);
        !copies && self.words <= self.shape.cols
    }

    /// Returns the words of the work area that a product of a vector of `len` values needs: [`Self::room`], or the
    /// vector and its tables.
    pub const fn work(&self, len: usize) -> usize {
        let room = self.room(len);
        #[cfg(feature = "scalar")]
        if matches!(self.shape.lanes, Lanes::Scalar) {
            let with_tables = self.words + crate::arch::Tables::room(self.shape.width, self.shape.units());
            return if with_tables > room { with_tables } else { room };
        }
        room
    }

    /// Returns the arguments of an assembler kernel.
    #[inline(always)]
    pub const fn arguments(&self) -> KernelArguments {
        self.arguments
    }

    /// Returns the columns of a group.
    const fn group(&self) -> usize {
        self.first + (self.chunks - 1) * self.layout.x.chunk
    }

    /// Returns the words of a group.
    pub(super) const fn group_words(&self) -> usize {
        self.layout.x.words(self.group()) + self.chunks * self.layout.x.start_words + self.layout.x.sum as usize
    }

    /// Returns the words of a chunk of `columns` columns.
    pub(super) const fn chunk_words(&self, columns: usize) -> usize {
        self.layout.x.start_words + self.layout.x.words(columns)
    }

    /// Returns the words before that of column `col`.
    pub(super) const fn words_before(&self, col: usize) -> usize {
        let (group, col) = (col / self.group(), col % self.group());
        let full_before = (col + self.layout.x.chunk - self.first) / self.layout.x.chunk;
        group * self.group_words() + (full_before + 1) * self.layout.x.start_words + self.layout.x.words(col)
    }

    /// Returns the lengths that the cost of preparing and of reading a vector depends on.
    pub(crate) const fn extent(&self) -> Extent {
        let passes = match (self.shape.group, self.layout.x.run) {
            (0, 1) => 0,
            (0, run) => div_up(self.padded, run),
            _ => self.groups,
        };
        Extent { columns: self.padded, groups: self.groups, chunks: self.groups * self.chunks, passes }
    }
}

/// Lengths that the cost of a prepared vector depends on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extent {
    /// Columns with padding.
    pub(crate) columns: usize,
    /// Groups; 1 without group scales.
    pub(crate) groups: usize,
    /// Chunks of all groups.
    pub(crate) chunks: usize,
    /// Passes through a kernel's loop of more than one step: groups, or parts of a row.
    pub(crate) passes: usize,
}

/// Returns enough words to prepare a vector for blocks of the DSP extension's layouts with these lanes and this group size:
/// the most that [`Plan::room`] returns. Paired lanes need the most for chunks of eight columns with a sum, unless pairs of
/// groups need more columns.
pub const fn max_prepared_words(cols: usize, group: usize, lanes: Lanes) -> usize {
    // Pairs of the columns, rounded up to a multiple of `unit`, and of a copy, if that has more columns.
    const fn pairs(cols: usize, unit: usize) -> usize {
        let padded = round_up(cols, unit);
        if padded == cols { padded / 2 } else { padded }
    }
    let is_paired = matches!(lanes, Lanes::Paired);
    if group == 0 {
        return 1 + if is_paired { pairs(cols, 8) + div_up(cols, 8) } else { pairs(cols, PAD_COLS) };
    }
    let others = if is_paired { 5 } else { 1 };
    let words = pairs(cols, group) + div_up(cols, group) * others;
    // Groups in pairs: two start words and the word of the sums.
    let in_pairs = if is_paired { pairs(cols, 2 * group) + div_up(cols, 2 * group) * 3 } else { 0 };
    if words > in_pairs { words } else { in_pairs }
}
