//! What a layout is: its cell, what it needs of the activations, and its arithmetic.

use super::width::Width;

/// Rows that share a word of group scales; blocks are padded to a multiple of this many rows.
pub const QUAD: usize = 4;

/// Rows of the highest strip: runs of rows that are computed together start at multiples of this.
pub const STRIP: usize = 8;

/// Activations are padded with zeros to a multiple of this many columns, which every layout's unit divides.
pub const PAD_COLS: usize = 32;

/// The size of a layout's cell.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Rows; divides [`QUAD`].
    pub rows: usize,
    /// Columns; divides [`PAD_COLS`].
    pub cols: usize,
    /// Words.
    pub words: usize,
}

impl Cell {
    /// Whether the cell's words hold codes of `bits` bits and nothing else.
    pub const fn is_full(self, bits: u32) -> bool {
        self.rows * self.cols * bits as usize == 32 * self.words
            && QUAD.is_multiple_of(self.rows)
            && PAD_COLS.is_multiple_of(self.cols)
    }
}

/// What a layout needs in the prepared activations: they are cut into chunks, whose sums a kernel takes apart before
/// they can overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct XLayout {
    /// The int16 pairs hold `x << shift`.
    pub shift: u8,
    /// Columns of a chunk, a power of two; a chunk ends with its scale group, too. Where a row's chunks are not all
    /// full, the first is short.
    pub chunk: usize,
    /// Columns of a pass through the loop of the kernel for row scales; the first pass may be short.
    pub run: usize,
    /// Words before a chunk's pairs, 1 or 2: what the kernel's sums start from.
    pub start_words: usize,
    /// What they hold.
    pub starts: [Start; 2],
    /// Whether the row's chunks are followed by the sum of its x, and those of a group by the sum of the group's in
    /// both halves of a word.
    pub sum: bool,
    /// Whether groups are taken in pairs: two are prepared as one, with their sums in the halves of the word, and the
    /// scales of strips of eight stand behind both groups' units.
    pub pairs: bool,
}

/// A start value, `bias + factor * sum(x)` over the chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// Keeps a lane from borrowing from its neighbour.
    pub bias: i32,
    /// Takes back what the codes' offset adds.
    pub factor: i32,
}

impl Start {
    /// No start value.
    pub const NONE: Self = Self { bias: 0, factor: 0 };
}

impl XLayout {
    /// A chunk that holds any group, or a row without groups: rows have at most 65535 columns.
    pub const ALL: usize = 1 << 16;

    /// Of single lanes: one start value a group.
    pub(super) const fn single(factor: i32) -> Self {
        let starts = [Start { bias: 0, factor }, Start::NONE];
        Self { shift: 0, chunk: Self::ALL, run: PAD_COLS, start_words: 1, starts, sum: false, pairs: false }
    }
}

/// Sums of a cell before they are taken apart.
pub type Sums = [i32; 3];

/// What a layout file provides.
pub trait Format {
    /// Code width.
    const WIDTH: Width;
    /// Rows, columns and words of a cell.
    const CELL: Cell;
    /// Rows of a strip: [`QUAD`] or [`STRIP`].
    const STRIP: usize;
    /// Rows are padded to a multiple of this many columns, the step of the kernel's loop.
    const STEP: usize;
    /// What the prepared activations look like.
    const X: XLayout;

    /// Puts `code` into a cell's words; the field must be zero before.
    #[cfg(feature = "writer")]
    fn insert(words: &mut [u32; 3], row: usize, col: usize, code: u8);

    /// The code at (`row`, `col`) of a cell.
    #[cfg(feature = "writer")]
    fn extract(words: &[u32; 3], row: usize, col: usize) -> u8;

    /// The sums that a chunk starts with, from its start words.
    fn start(starts: &[u32]) -> Sums {
        [starts.first().map_or(0, |w| *w as i32); 3]
    }

    /// Adds a cell's products to its sums, modulo 2^32. `x` holds `CELL.cols / 2` int16 pairs.
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums);

    /// Adds what a chunk's sums mean, `sum(level * x)` of each of the cell's rows. Where [`XLayout::sum`] says so, the
    /// sum of the group's x is still missing in rows of odd index.
    fn finish(t: &Sums, rows: &mut [i32]);
}

/// `c + a.lo * b.lo + a.hi * b.hi` over signed 16-bit halves, modulo 2^32: what the SMLAD instruction computes.
#[inline(always)]
pub(super) fn smlad(a: u32, b: u32, c: i32) -> i32 {
    let lo = (a as i16 as i32).wrapping_mul(b as i16 as i32);
    let hi = ((a as i32) >> 16).wrapping_mul((b as i32) >> 16);
    c.wrapping_add(lo).wrapping_add(hi)
}
