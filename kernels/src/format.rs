//! Packed weight layouts: what stands in flash, written once for the packer, the reference and the kernels.
//!
//! A [`Block`] is a run of rows of one [`Width`]. Its rows are interleaved in **strips** of 4 or 8, so that one load of
//! activations serves them all and the weight stream is read strictly forward. A layout packs **cells**: a few rows by a few
//! columns in whole words. A strip is a run of **units**, each one cell high in columns and as many cells as the strip's rows
//! need; word `k` of all cells of a unit stand side by side:
//!
//! ```text
//! strip:  unit 0: w0(cell 0) w0(cell 1) .. [w1(cell 0) w1(cell 1) ..]   unit 1: ...   [scales of group 0]   ...
//! ```
//!
//! With group scales, a word of four u8 for every four rows (the first in the low byte) follows the units of each group. In
//! strips of eight of [`w2_paired`], the scales of two groups follow the units of both: a word for every two rows, with theirs
//! in the first group and then theirs in the second; a last group that is left over has its own. Where at most four rows are
//! left for the last strip of eight, it is a strip of four. Rows beyond the block's last one, up to the strip's end, and columns
//! beyond the last, up to a multiple of the kernel's step, are padding with code 0.
//!
//! Every width has two layouts. In **single** lanes, each signed 16-bit lane of an SMLAD operand holds one weight, and the
//! activations may have 16 bits. In **paired** lanes a lane holds the weights of two rows, one SMLAD makes four MACs, and the
//! sums are taken apart when they are full; that needs `|x| <= 127`.
//!
//! | layout | levels (weight / scale) | cell: rows x columns in words | strip | bits per weight before scales |
//! |---|---|---|---|---|
//! | [`w2`] | -3, -1, 1, 3 | 1 x 16 in 1 | 4 | 2 |
//! | [`w3`] | -7, -5 .. 7 | 1 x 32 in 3 | 4 | 3 |
//! | [`w4`] | -15, -13 .. 15 | 1 x 8 in 1 | 4 | 4 |
//! | [`w8`] | -128 .. 127 | 1 x 4 in 1 | 4 | 8 |
//! | [`w2_paired`] | as w2 | 2 x 8 in 1 | 8 | 2 |
//! | [`w3_paired`] | as w3 | 4 x 8 in 3 | 4 | 3 |
//! | [`w4_paired`] | as w4 | 4 x 2 in 1 | 8 | 4 |
//! | [`w8_paired`] | as w8 | 2 x 2 in 1 | 4 | 8 |
//!
//! Narrow widths use the mid-rise grid of odd levels: for bell-shaped weights four levels at ±1, ±3 lose about a third less
//! than -2 .. 1 do. A level is `2*code - (2^b - 1)`; the kernels multiply with the codes, and what the codes' offset adds is
//! taken back by the start values that stand in the prepared activations ([`XFormat`]).

pub mod w2;
pub mod w2_paired;
pub mod w3;
pub mod w3_paired;
pub mod w4;
pub mod w4_paired;
pub mod w8;
pub mod w8_paired;

/// Changes whenever a packed layout changes meaning; stamped into every image.
pub const LAYOUT_STAMP: u32 = 4;

/// Rows that share a word of group scales; blocks are padded to a multiple of this many rows.
pub const QUAD: usize = 4;

/// Rows of the highest strip: runs of rows that are computed together start at multiples of this.
pub const STRIP: usize = 8;

/// Columns that a block of paired lanes may have with group scales. The 2-bit kernel sums twice a row's products
/// (`w2_paired`), `2 * 3 * 127 * 255` a column at most, in an int32.
pub const MAX_PAIRED_GROUPED: usize = 11_051;

/// Activations are padded with zeros to a multiple of this many columns, which every layout's unit divides.
pub const PAD_COLS: usize = 32;

/// The most columns that share a group scale.
pub const MAX_GROUP: usize = 128;

/// Bits of a weight code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Width {
    /// 2 bits: levels -3, -1, 1, 3.
    W2,
    /// 3 bits: odd levels -7 to 7.
    W3,
    /// 4 bits: odd levels -15 to 15.
    W4,
    /// 8 bits: levels -128 to 127.
    W8,
}

impl Width {
    /// All widths, narrow to wide.
    pub const ALL: [Self; 4] = [Self::W2, Self::W3, Self::W4, Self::W8];

    /// The width of `bits`, if there is one.
    pub const fn from_bits(bits: u32) -> Option<Self> {
        Some(match bits {
            2 => Self::W2,
            3 => Self::W3,
            4 => Self::W4,
            8 => Self::W8,
            _ => return None,
        })
    }

    /// Bits of a code: 2, 3, 4 or 8.
    pub const fn bits(self) -> u32 {
        match self {
            Self::W2 => w2::BITS,
            Self::W3 => w3::BITS,
            Self::W4 => w4::BITS,
            Self::W8 => w8::BITS,
        }
    }

    /// The level (weight divided by its scale) that `code` stands for. Bits of `code` above the width are ignored.
    pub const fn level(self, code: u8) -> i32 {
        match self {
            Self::W8 => code as i8 as i32,
            _ => {
                let top = (1 << self.bits()) - 1;
                2 * (code as i32 & top) - top
            }
        }
    }

    /// The largest magnitude of a level.
    pub const fn max_level(self) -> i32 {
        match self {
            Self::W8 => 128,
            _ => (1 << self.bits()) - 1,
        }
    }

    /// The code whose level is nearest to `x` (a weight divided by its scale); ties go to the even code. At 8 bits the result
    /// is symmetric: -128 is not used. NaN gives the lowest code.
    pub fn nearest_code(self, x: f32) -> u8 {
        match self {
            Self::W8 => libm::rintf(x.clamp(-127.0, 127.0)) as i32 as u8,
            _ => {
                let top = (1u32 << self.bits()) - 1;
                libm::rintf((x + top as f32) * 0.5).clamp(0.0, top as f32) as u8
            }
        }
    }
}

/// How many weights a 16-bit lane of an SMLAD operand holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Lanes {
    /// One.
    Single,
    /// Two, of different rows; activations are at most 127.
    Paired,
}

impl Lanes {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Single, Self::Paired];

    /// The largest activation that paired lanes hold.
    pub const PAIRED_X_MAX: u16 = 127;

    /// The lanes of a matrix with activations up to `x_max` and scale groups of `group` columns: paired where they can be,
    /// which is for int8 activations and row scales or groups of 32.
    pub const fn of(x_max: u16, group: usize) -> Self {
        if x_max <= Self::PAIRED_X_MAX && matches!(group, 0 | 32) { Self::Paired } else { Self::Single }
    }

    /// As it stands in a block record: 0 or 1.
    pub const fn code(self) -> u8 {
        match self {
            Self::Single => 0,
            Self::Paired => 1,
        }
    }

    /// The inverse of [`Self::code`].
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Single),
            1 => Some(Self::Paired),
            _ => None,
        }
    }
}

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

/// What a layout needs in the prepared activations: they are cut into chunks, whose sums a kernel takes apart before they can
/// overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct XFormat {
    /// The int16 pairs hold `x << shift`.
    pub shift: u32,
    /// Columns of a chunk, a power of two; a chunk ends with its scale group, too. Where a row's chunks are not all full, the
    /// first is short.
    pub chunk: usize,
    /// Columns of a pass through the loop of the kernel for row scales; the first pass may be short.
    pub run: usize,
    /// Words before a chunk's pairs, 1 or 2: what the kernel's sums start from.
    pub start_words: usize,
    /// What they hold.
    pub starts: [Start; 2],
    /// Whether the row's chunks are followed by the sum of its x, and those of a group by the sum of the group's in both halves of
    /// a word.
    pub sum: bool,
    /// Whether groups are taken in pairs: two are prepared as one, with their sums in the halves of the word, and the scales of
    /// strips of eight stand behind both groups' units.
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

impl XFormat {
    /// A chunk that holds any group, or a row without groups: rows have at most 65535 columns.
    pub const ALL: usize = 1 << 16;

    /// Of single lanes: one start value a group.
    const fn single(factor: i32) -> Self {
        let starts = [Start { bias: 0, factor }, Start::NONE];
        Self { shift: 0, chunk: Self::ALL, run: PAD_COLS, start_words: 1, starts, sum: false, pairs: false }
    }
}

/// Sums of a cell before they are taken apart.
pub type Sums = [i32; 3];

/// What a layout file provides. Its kernel in assembler is in `crate::armv7em`.
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
    const X: XFormat;

    /// Puts `code` into a cell's words; the field must be zero before.
    fn insert(words: &mut [u32; 3], row: usize, col: usize, code: u8);

    /// The code at (`row`, `col`) of a cell.
    fn extract(words: &[u32; 3], row: usize, col: usize) -> u8;

    /// The sums that a chunk starts with, from its start words.
    fn start(starts: &[u32]) -> Sums {
        [starts.first().map_or(0, |w| *w as i32); 3]
    }

    /// Adds a cell's products to its sums, modulo 2^32. `x` holds `CELL.cols / 2` int16 pairs.
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums);

    /// Adds what a chunk's sums mean, `sum(level * x)` of each of the cell's rows. Where [`XFormat::sum`] says so, the sum of
    /// the group's x is still missing in rows of odd index.
    fn finish(t: &Sums, rows: &mut [i32]);
}

/// Calls a function that is generic over the layout of `$shape`.
macro_rules! with_format {
    ($shape:expr, $call:ident::<_>($($argument:expr),*)) => {{
        use $crate::format::{Lanes, Width, w2, w2_paired, w3, w3_paired, w4, w4_paired, w8, w8_paired};
        match ($shape.width, $shape.lanes) {
            (Width::W2, Lanes::Single) => $call::<w2::W2>($($argument),*),
            (Width::W3, Lanes::Single) => $call::<w3::W3>($($argument),*),
            (Width::W4, Lanes::Single) => $call::<w4::W4>($($argument),*),
            (Width::W8, Lanes::Single) => $call::<w8::W8>($($argument),*),
            (Width::W2, Lanes::Paired) => $call::<w2_paired::W2Paired>($($argument),*),
            (Width::W3, Lanes::Paired) => $call::<w3_paired::W3Paired>($($argument),*),
            (Width::W4, Lanes::Paired) => $call::<w4_paired::W4Paired>($($argument),*),
            (Width::W8, Lanes::Paired) => $call::<w8_paired::W8Paired>($($argument),*),
        }
    }};
}
pub(crate) use with_format;

/// The constants of a layout, for code that is not generic over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) cell: Cell,
    /// Words of a unit for [`QUAD`] rows.
    quad_words: usize,
    strip: usize,
    pub(crate) step: usize,
    pub(crate) x: XFormat,
    /// Columns that activations are padded to a multiple of, where their group is not longer.
    pub(crate) pad: usize,
    /// Binary logarithms, because nothing is divided when a GEMV is called.
    pub(crate) chunk_log: u32,
    #[cfg(actq_armv7em)]
    pub(crate) strip_log: u32,
    #[cfg(actq_armv7em)]
    pub(crate) step_log: u32,
    #[cfg(actq_armv7em)]
    pub(crate) kernels: [crate::armv7em::Kernels; 2],
    #[cfg(actq_fpu)]
    pub(crate) quantize: crate::armv7em::Quantize,
}

impl Layout {
    const fn of<F: Format>() -> Self {
        Self {
            cell: F::CELL,
            quad_words: F::CELL.words * QUAD / F::CELL.rows,
            strip: F::STRIP,
            step: F::STEP,
            x: F::X,
            pad: if F::X.chunk == XFormat::ALL { PAD_COLS } else { F::STEP },
            chunk_log: F::X.chunk.trailing_zeros(),
            #[cfg(actq_armv7em)]
            strip_log: F::STRIP.trailing_zeros(),
            #[cfg(actq_armv7em)]
            step_log: F::STEP.trailing_zeros(),
            #[cfg(actq_armv7em)]
            kernels: crate::armv7em::kernels::<F>(),
            #[cfg(actq_fpu)]
            quantize: crate::armv7em::quantizer::<F>(),
        }
    }
}

/// By width and lanes. A table in memory takes fewer instructions than a choice for every constant.
static LAYOUTS: [[Layout; 2]; 4] = [
    [Layout::of::<w2::W2>(), Layout::of::<w2_paired::W2Paired>()],
    [Layout::of::<w3::W3>(), Layout::of::<w3_paired::W3Paired>()],
    [Layout::of::<w4::W4>(), Layout::of::<w4_paired::W4Paired>()],
    [Layout::of::<w8::W8>(), Layout::of::<w8_paired::W8Paired>()],
];

/// `c + a.lo * b.lo + a.hi * b.hi` over signed 16-bit halves, modulo 2^32: what the SMLAD instruction computes.
#[inline(always)]
pub(crate) fn smlad(a: u32, b: u32, c: i32) -> i32 {
    let lo = (a as i16 as i32).wrapping_mul(b as i16 as i32);
    let hi = ((a as i32) >> 16).wrapping_mul((b as i32) >> 16);
    c.wrapping_add(lo).wrapping_add(hi)
}

/// `len` up to a multiple of `step`, a power of two.
pub(crate) const fn round_up(len: usize, step: usize) -> usize {
    (len + step - 1) & !(step - 1)
}

/// How many times `step`, a power of two, fits into `len`. Without a division and its panic.
pub(crate) const fn div_down(len: usize, step: usize) -> usize {
    len >> step.trailing_zeros()
}

/// How many times `step`, a power of two, covers `len`.
pub(crate) const fn div_up(len: usize, step: usize) -> usize {
    (len + step - 1) >> step.trailing_zeros()
}

/// The shape of a [`Block`]: rows of one width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockShape {
    /// Code width.
    pub width: Width,
    /// Weights in a lane.
    pub lanes: Lanes,
    /// Rows, at least 1.
    pub rows: usize,
    /// Columns, at least 1.
    pub cols: usize,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = none, the row's scale alone.
    pub group: usize,
}

impl BlockShape {
    /// Whether the lengths are usable: rows and columns from 1 to 65535 and a group that the lanes know; with groups in paired
    /// lanes at most [`MAX_PAIRED_GROUPED`] columns.
    pub const fn is_valid(self) -> bool {
        let (group, cols) = match self.lanes {
            Lanes::Single => (matches!(self.group, 0 | 32 | 64 | MAX_GROUP), 0xffff),
            Lanes::Paired => (self.group == 0 || self.group == 32, MAX_PAIRED_GROUPED),
        };
        let cols = if self.group == 0 { 0xffff } else { cols };
        self.rows >= 1 && self.rows <= 0xffff && self.cols >= 1 && self.cols <= cols && group
    }

    #[inline(always)]
    pub(crate) const fn layout(self) -> &'static Layout {
        &LAYOUTS[self.width as usize][self.lanes as usize]
    }

    /// Rows of a strip: [`QUAD`] or [`STRIP`].
    pub(crate) const fn strip_rows(self) -> usize {
        self.layout().strip
    }

    /// Columns of a unit.
    pub(crate) const fn cell_cols(self) -> usize {
        self.layout().cell.cols
    }

    /// Rows with the padding.
    pub const fn padded_rows(self) -> usize {
        self.rows.next_multiple_of(QUAD)
    }

    /// Columns that the weights are padded to a multiple of. With paired lanes, all groups are whole.
    pub(crate) const fn step(self) -> usize {
        match (self.lanes, self.group) {
            (Lanes::Paired, 1..) => self.group,
            _ => self.layout().step,
        }
    }

    /// Units in a row.
    pub const fn units(self) -> usize {
        div_down(round_up(self.cols, self.step()), self.layout().cell.cols)
    }

    /// Units in a full group; all units of a row where there are no group scales.
    #[inline(never)]
    pub const fn units_per_group(self) -> usize {
        match self.group {
            0 => self.units(),
            group => div_down(group, self.layout().cell.cols),
        }
    }

    /// Group scales of a row; 0 where there are none.
    pub const fn groups(self) -> usize {
        match self.group {
            0 => 0,
            group => div_up(self.cols, group),
        }
    }

    /// Words of four rows, scales included; a strip of eight has twice as many.
    #[inline(never)]
    pub const fn quad_words(self) -> usize {
        self.units() * self.layout().quad_words + self.groups()
    }

    /// Words of the block.
    pub const fn words(self) -> usize {
        self.padded_rows() / QUAD * self.quad_words()
    }

    /// First row and rows of the strip that `row` is in.
    const fn strip(self, row: usize) -> (usize, usize) {
        let height = self.layout().strip;
        let first = row & !(height - 1);
        let left = self.padded_rows() - first;
        (first, if left < height { left } else { height })
    }

    /// Index of the first word of a cell and the distance to its next word: the cell that holds `row` in unit `unit`.
    const fn cell_at(self, row: usize, unit: usize) -> (usize, usize) {
        let (first, height) = self.strip(row);
        let Cell { rows, words, .. } = self.layout().cell;
        let groups_before = match self.group {
            0 => 0,
            _ => div_down(unit, self.units_per_group()),
        };
        // The scales of a pair stand behind its second group.
        let groups_before = if self.in_pairs(height) { groups_before & !1 } else { groups_before };
        let scales_before = groups_before * (height / QUAD);
        let step = div_down(height, rows);
        let strip = first / QUAD * self.quad_words();
        (strip + unit * words * step + scales_before + div_down(row - first, rows), step)
    }

    /// Whether the scales of a strip of so many rows stand behind pairs of groups.
    const fn in_pairs(self, height: usize) -> bool {
        self.layout().x.pairs && height == STRIP
    }

    /// Index of the word that holds the scale of `group` for `row`, and the scale's first bit.
    const fn scale_at(self, row: usize, group: usize) -> (usize, usize) {
        let (first, height) = self.strip(row);
        let row = row - first;
        let pair = self.in_pairs(height) && (group | 1) < self.groups();
        let (first_group, last_group) = if pair { (group & !1, group | 1) } else { (group, group) };
        let last = (last_group + 1) * self.units_per_group();
        let units = if last < self.units() { last } else { self.units() };
        let Cell { rows, words, .. } = self.layout().cell;
        let before = first / QUAD * self.quad_words() + units * words * div_down(height, rows);
        let scales_before = first_group * (height / QUAD);
        match pair {
            true => (before + scales_before + row / 2, 16 * (group % 2) + 8 * (row % 2)),
            false => (before + scales_before + row / QUAD, 8 * (row % QUAD)),
        }
    }
}

/// A block's words in place, of exactly the length that its shape asks for.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    shape: BlockShape,
    quad_words: usize,
    words: &'a [u32],
}

impl<'a> Block<'a> {
    /// Pairs `words` (little-endian words as they stand in the image) with their shape; `None` where the shape is not
    /// valid or the length differs from [`BlockShape::words`].
    pub fn new(shape: BlockShape, words: &'a [u32]) -> Option<Self> {
        if !shape.is_valid() {
            return None;
        }
        Self::leading(shape, words).filter(|block| block.words.len() == words.len())
    }

    /// The block of a valid shape that `words` begins with; `None` where words are missing.
    #[inline(always)]
    pub(crate) fn leading(shape: BlockShape, words: &'a [u32]) -> Option<Self> {
        let quad_words = shape.quad_words();
        let words = words.get(..div_up(shape.rows, QUAD) * quad_words)?;
        Some(Self { shape, quad_words, words })
    }

    /// The shape.
    pub fn shape(&self) -> BlockShape {
        self.shape
    }

    /// As [`BlockShape::quad_words`].
    pub fn quad_words(&self) -> usize {
        self.quad_words
    }

    /// All words.
    #[inline(always)]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// The words of the rows from `first_row`, a multiple of [`STRIP`], on; empty when out of range.
    pub fn rows_from(&self, first_row: usize) -> &'a [u32] {
        self.words.get((first_row / QUAD).saturating_mul(self.quad_words)..).unwrap_or(&[])
    }

    /// The code at (`row`, `col`); 0 when out of range.
    pub fn code(&self, row: usize, col: usize) -> u8 {
        if row >= self.shape.rows || col >= self.shape.cols {
            return 0;
        }
        let Cell { rows, cols, .. } = self.shape.layout().cell;
        let cell = self.cell(row, div_down(col, cols));
        with_format!(self.shape, extract::<_>(&cell, row & (rows - 1), col & (cols - 1)))
    }

    /// The words of the cell that holds `row` in unit `unit`.
    pub(crate) fn cell(&self, row: usize, unit: usize) -> [u32; 3] {
        let (at, step) = self.shape.cell_at(row, unit);
        let mut cell = [0u32; 3];
        for (k, word) in cell.iter_mut().enumerate().take(self.shape.layout().cell.words) {
            *word = u32::from_le(self.words.get(at + k * step).copied().unwrap_or(0));
        }
        cell
    }

    /// The level at (`row`, `col`), without any scale.
    pub fn level(&self, row: usize, col: usize) -> i32 {
        self.shape.width.level(self.code(row, col))
    }

    /// The u8 scale that (`row`, `col`) is multiplied with; 1 where the block has no group scales.
    pub fn group_scale(&self, row: usize, col: usize) -> u8 {
        match self.shape.group {
            0 => 1,
            group => {
                let (at, bit) = self.shape.scale_at(row, div_down(col, group));
                (u32::from_le(self.words.get(at).copied().unwrap_or(0)) >> bit) as u8
            }
        }
    }
}

fn extract<F: Format>(words: &[u32; 3], row: usize, col: usize) -> u8 {
    F::extract(words, row, col)
}

/// Packs a block.
///
/// `codes` is row-major, `rows * cols`; `scales` is row-major, `rows * groups()` (empty without groups); `out` holds exactly
/// [`BlockShape::words`] words and is overwritten. Returns `None` where a length or the shape does not fit.
pub fn pack(shape: BlockShape, codes: &[u8], scales: &[u8], out: &mut [u32]) -> Option<()> {
    if !shape.is_valid()
        || codes.len() != shape.rows * shape.cols
        || scales.len() != shape.rows * shape.groups()
        || out.len() != shape.words()
    {
        return None;
    }
    out.fill(0);
    with_format!(shape, pack_codes::<_>(shape, codes, out));
    if shape.groups() > 0 {
        for (row, row_scales) in scales.chunks_exact(shape.groups()).enumerate() {
            for (group, &scale) in row_scales.iter().enumerate() {
                let (at, bit) = shape.scale_at(row, group);
                out[at] |= (scale as u32) << bit;
            }
        }
    }
    for word in out.iter_mut() {
        *word = word.to_le();
    }
    Some(())
}

fn pack_codes<F: Format>(shape: BlockShape, codes: &[u8], out: &mut [u32]) {
    for first_row in (0..shape.padded_rows()).step_by(F::CELL.rows) {
        for unit in 0..shape.units() {
            // Padding has code 0, too, which is not always a field of zeros.
            let mut words = [0u32; 3];
            for row in 0..F::CELL.rows {
                for col in 0..F::CELL.cols {
                    let at = unit * F::CELL.cols + col;
                    let code = if at < shape.cols { codes.get((first_row + row) * shape.cols + at) } else { None };
                    F::insert(&mut words, row, col, code.copied().unwrap_or(0));
                }
            }
            let (at, step) = shape.cell_at(first_row, unit);
            for (k, &word) in words.iter().enumerate().take(F::CELL.words) {
                out[at + k * step] = word;
            }
        }
    }
}
