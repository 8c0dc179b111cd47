//! Definition of a layout: its cell, its form of the activations, and its arithmetic.

use super::width::Width;

/// Rows that share a word of group scales; blocks are padded to a multiple of this many rows.
pub const QUAD: usize = 4;

/// Rows of the highest strip. Rows that are computed together start at a multiple of this.
pub const STRIP: usize = 8;

/// Activations are padded with zeros to a multiple of this number of columns. Every layout's unit divides it.
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
    /// Returns `true` if the cell's words hold codes of `bits` bits and nothing else.
    pub const fn is_full(self, bits: u32) -> bool {
        self.rows * self.cols * bits as usize == 32 * self.words
            && QUAD.is_multiple_of(self.rows)
            && PAD_COLS.is_multiple_of(self.cols)
    }
}

/// `true` if the kernels in assembler have short loops, which take less code and more time.
pub(super) const COMPACT: bool = cfg!(feature = "compact");

/// The form of the prepared activations for a layout: they are cut into column chunks, whose sums a kernel separates
/// before they can overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct XLayout {
    /// The int16 pairs hold `x << shift`.
    pub shift: u8,
    /// Columns of a column chunk, a power of two; a chunk also ends with its scale group. If not all chunks of a row
    /// are full, the first is short.
    pub chunk: usize,
    /// Columns of a pass through the loop of the kernel for row scales; the first pass may be short.
    pub run: usize,
    /// Words before a chunk's pairs, at most 2: the start values of the kernel's sums.
    pub start_words: usize,
    /// Start values in these words.
    pub starts: [Start; 2],
    /// `true` if the sum of the row's x follows its chunks, and the sum of a group's x follows the group's chunks, in
    /// both halves of a word.
    pub sum: bool,
    /// `true` if the activations are bytes, four a word, and the weights vectors of bytes.
    pub bytes: bool,
    /// `true` if groups are paired: two are prepared as one, with their sums in the halves of the word, and in strips
    /// of eight the scales follow the units of both groups.
    pub pairs: bool,
}

/// A start value, `bias + factor * sum(x)` over the chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// Bias that keeps a lane from borrowing from its neighbour.
    pub bias: i32,
    /// Factor that cancels the offset of the codes.
    pub factor: i32,
}

impl Start {
    /// No start value.
    pub const NONE: Self = Self { bias: 0, factor: 0 };
}

impl XLayout {
    /// A column chunk that holds any group, or a row without groups: rows have at most 65535 columns.
    pub const ALL: usize = 1 << 16;

    /// Pairs, and nothing else.
    #[cfg(feature = "scalar")]
    pub(super) const PLAIN: Self = Self { start_words: 0, ..Self::single(0) };

    /// Returns the form for single lanes: one start value a group.
    pub(super) const fn single(factor: i32) -> Self {
        let starts = [Start { bias: 0, factor }, Start::NONE];
        Self {
            shift: 0,
            chunk: Self::ALL,
            run: PAD_COLS,
            start_words: 1,
            starts,
            sum: false,
            bytes: false,
            pairs: false,
        }
    }

    /// Bytes, and before them their sum.
    #[cfg(feature = "helium")]
    pub(super) const BYTES: Self = Self { bytes: true, ..Self::single(1) };

    /// Returns `true` if the activations are bytes: in a build without such layouts, at compile time.
    #[inline(always)]
    pub(crate) const fn has_bytes(&self) -> bool {
        cfg!(feature = "helium") && self.bytes
    }

    /// Returns the words of a number of columns.
    #[inline(always)]
    pub(crate) const fn words(&self, columns: usize) -> usize {
        if self.has_bytes() { columns / 4 } else { columns / 2 }
    }
}

/// Sums of a cell before they are separated.
pub type Sums = [i32; 4];

/// A kernel in Rust.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// It takes strips one by one, by [`Format::mac`] and [`Format::finish`].
    Strips,
    /// It looks up sums of columns by bit planes: word `p` of a cell has bit `p` of every code.
    Planes,
    /// It multiplies pairs of rows, chunk by chunk.
    Pairs,
    /// It multiplies pairs of rows, two columns by two.
    Bytes,
    /// It takes four units at a time, as vectors.
    Vectors,
}

/// A layout. Each layout file implements it.
pub trait Format {
    /// Code width.
    const WIDTH: Width;
    /// Rows, columns and words of a cell.
    const CELL: Cell;
    /// Rows of a strip: [`QUAD`] or [`STRIP`].
    const STRIP: usize;
    /// Rows are padded to a multiple of this number of columns, the step of the kernel's loop.
    const STEP: usize;
    /// Form of the prepared activations.
    const X: XLayout;
    /// Units that a pass of the portable kernel's loop takes. Columns of a row are a multiple of the step.
    const PASS: usize = if Self::STEP > Self::CELL.cols { 2 } else { 1 };
    /// The portable kernel.
    const KERNEL: Kernel = Kernel::Strips;

    /// The bits of a code.
    const CODE_BITS: u32 = (1 << Self::WIDTH.bits()) - 1;

    /// Returns the place of the code at (`row`, `col`) of a cell: the index of its part ([`Self::parts`]), its first
    /// bit there, modulo 32, and the bits of the code that are stored inverted.
    fn place(row: usize, col: usize) -> (usize, usize, u32);

    /// Returns a cell's parts, words in each of which whole codes are: its words, and zeros.
    fn parts([w0, w1, w2]: [u32; 3]) -> [u32; 8] {
        [w0, w1, w2, 0, 0, 0, 0, 0]
    }

    /// Returns the words of a cell: the inverse of [`Self::parts`].
    fn whole([w0, w1, w2, ..]: [u32; 8]) -> [u32; 3] {
        [w0, w1, w2]
    }

    /// Writes `code` into a cell's words; the field must be zero before.
    fn insert(words: &mut [u32; 3], row: usize, col: usize, code: u8) {
        let (part, bit, inverted) = Self::place(row, col);
        let mut parts = Self::parts(*words);
        parts[part] |= (u32::from(code) & Self::CODE_BITS ^ inverted).rotate_left(bit as u32);
        *words = Self::whole(parts);
    }

    /// Returns the code at (`row`, `col`) of a cell.
    fn extract(words: [u32; 3], row: usize, col: usize) -> u8 {
        let (part, bit, inverted) = Self::place(row, col);
        (Self::parts(words)[part & 7].rotate_right(bit as u32) & Self::CODE_BITS ^ inverted) as u8
    }

    /// Returns the initial sums of a chunk, from its start words.
    fn start(starts: &[u32]) -> Sums {
        [starts.first().map_or(0, |w| *w as i32); 4]
    }

    /// Adds a cell's products to its sums, modulo 2^32. `x` holds `CELL.cols / 2` int16 pairs.
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums);

    /// Separates the sums of a chunk of `cols` columns and adds `sum(level * x)` for each of the cell's rows. With
    /// [`XLayout::sum`], the sum of the group's x is still missing in rows of odd index.
    fn finish(t: &Sums, cols: usize, rows: &mut [i32]);
}

/// Writes a code's bits into a cell's planes, whose bits must be zero before.
#[cfg(feature = "scalar")]
pub(super) fn set_plane_code<F: Format>(planes: &mut [u32; 3], row: usize, col: usize, code: u8) {
    for (p, plane) in planes.iter_mut().enumerate().take(F::CELL.words) {
        *plane |= (u32::from(code) >> p & 1) << (8 * row + col);
    }
}

/// Returns the code of a cell's planes.
#[cfg(feature = "scalar")]
pub(super) fn plane_code<F: Format>(planes: [u32; 3], row: usize, col: usize) -> u8 {
    (0..F::CELL.words).fold(0, |code, p| code | ((planes[p] >> (8 * row + col) & 1) as u8) << p)
}

/// Computes `c + a.lo * b.lo + a.hi * b.hi` over signed 16-bit halves, modulo 2^32, as the SMLAD instruction does.
#[inline(always)]
pub(super) fn smlad(a: u32, b: u32, c: i32) -> i32 {
    let lo = (a as i16 as i32).wrapping_mul(b as i16 as i32);
    let hi = ((a as i32) >> 16).wrapping_mul((b as i32) >> 16);
    c.wrapping_add(lo).wrapping_add(hi)
}
