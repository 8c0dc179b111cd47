//! Packed weight layouts: what stands in flash, written once for the packer, the reference and the kernels.
//!
//! A [`Block`] is a run of rows of one [`Width`]. Four rows are interleaved into a **quad**, so that one load of activations
//! serves four rows and the weight stream is read strictly forward. A quad is a run of **units**: the smallest number of
//! columns that fills whole words in every row. Word `k` of the four rows stand side by side:
//!
//! ```text
//! quad q:  unit 0: w0(r0) w0(r1) w0(r2) w0(r3) [w1(r0) .. w1(r3) ...]   unit 1: ...   [scales of group 0]   ...
//! ```
//!
//! With group scales, one word of four u8 (row 0 in the low byte) follows the units of each group. Rows beyond the block's
//! last one, up to the quad's fourth, and columns beyond the last, up to the unit's end, are padding with code 0.
//!
//! | width | levels (weight / scale) | columns per unit | words per unit and row | bits per weight before scales |
//! |---|---|---|---|---|
//! | [`w2`] | -3, -1, 1, 3 | 16 | 1 | 2 |
//! | [`w3`] | -7, -5 .. 7 | 32 | 3 | 3 |
//! | [`w4`] | -15, -13 .. 15 | 8 | 1 | 4 |
//! | [`w8`] | -128 .. 127 | 4 | 1 | 8 |
//!
//! Narrow widths use the mid-rise grid of odd levels: for bell-shaped weights four levels at ±1, ±3 lose about a third less
//! than -2 .. 1 do. A level is `2*code - (2^b - 1)`; the kernels extract the doubled code with the same AND that would extract
//! the code, and the subtraction is one start value per group, `-(2^b - 1) * sum(x)`.

pub mod w2;
pub mod w3;
pub mod w4;
pub mod w8;

/// Changes whenever a packed layout changes meaning; stamped into every image.
pub const LAYOUT_STAMP: u32 = 1;

/// Rows interleaved in one quad.
pub const QUAD: usize = 4;

/// Activations are padded with zeros to a multiple of this many columns, which every layout's unit divides.
pub const PAD_COLS: usize = 32;

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

    pub(crate) const fn unit(self) -> Unit {
        match self {
            Self::W2 => w2::UNIT,
            Self::W3 => w3::UNIT,
            Self::W4 => w4::UNIT,
            Self::W8 => w8::UNIT,
        }
    }
}

/// The size of a layout's unit.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// Columns that a unit covers; divides [`PAD_COLS`].
    pub cols: usize,
    /// Words per row of a unit.
    pub words: usize,
}

/// What a layout file provides. The kernels for a quad are in [`crate::portable`] and `crate::armv7em`.
pub trait Format {
    /// Columns and words of a unit.
    const UNIT: Unit;
    /// Code width.
    const WIDTH: Width;

    /// Puts `code` into a row's words of a unit; the words' field must be zero before.
    fn insert(words: &mut [u32], col: usize, code: u8);

    /// The code at `col` of a unit, from the row's words.
    fn extract(words: &[u32], col: usize) -> u8;

    /// Adds a unit's products to four rows' sums, modulo 2^32: `t[r] += sum((level + offset) * x)`, where offset is
    /// `2^bits - 1` for the narrow widths and 0 at 8 bits. `words` holds [`QUAD`]` * UNIT.words` words, `x` holds
    /// `UNIT.cols / 2` int16 pairs.
    fn mac_quad(words: &[u32], x: &[u32], t: &mut [i32; QUAD]);
}

/// `c + a.lo * b.lo + a.hi * b.hi` over signed 16-bit halves, modulo 2^32: what the SMLAD instruction computes.
#[inline(always)]
pub(crate) fn smlad(a: u32, b: u32, c: i32) -> i32 {
    let lo = (a as i16 as i32).wrapping_mul(b as i16 as i32);
    let hi = ((a as i32) >> 16).wrapping_mul((b as i32) >> 16);
    c.wrapping_add(lo).wrapping_add(hi)
}

/// The shape of a [`Block`]: rows of one width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockShape {
    /// Code width.
    pub width: Width,
    /// Rows, at least 1.
    pub rows: usize,
    /// Columns, at least 1.
    pub cols: usize,
    /// Columns that share a u8 scale: 32, 64 or 128; 0 = none, the row's scale alone.
    pub group: usize,
}

impl BlockShape {
    /// Whether the lengths are usable: rows and columns from 1 to 65535 and a known group.
    pub const fn is_valid(self) -> bool {
        self.rows >= 1
            && self.rows <= 0xffff
            && self.cols >= 1
            && self.cols <= 0xffff
            && matches!(self.group, 0 | 32 | 64 | 128)
    }

    /// Number of quads.
    pub const fn quads(self) -> usize {
        self.rows.div_ceil(QUAD)
    }

    /// Units in a row.
    pub const fn units(self) -> usize {
        self.cols.div_ceil(self.width.unit().cols)
    }

    /// Units in a full group; all units of a row where there are no group scales.
    pub const fn units_per_group(self) -> usize {
        match self.group {
            0 => self.units(),
            group => group / self.width.unit().cols,
        }
    }

    /// Group scales of a row; 0 where there are none.
    pub const fn groups(self) -> usize {
        match self.group {
            0 => 0,
            group => self.cols.div_ceil(group),
        }
    }

    /// Words of a quad, scales included.
    pub const fn quad_words(self) -> usize {
        self.units() * self.width.unit().words * QUAD + self.groups()
    }

    /// Words of the block.
    pub const fn words(self) -> usize {
        self.quads() * self.quad_words()
    }

    /// Index of word 0 of (`row`, `unit`); word k of the same unit stands [`QUAD`]` * k` words later.
    const fn unit_at(self, row: usize, unit: usize) -> usize {
        let scales_before = match self.group {
            0 => 0,
            _ => unit / self.units_per_group(),
        };
        (row / QUAD) * self.quad_words() + unit * self.width.unit().words * QUAD + scales_before + row % QUAD
    }

    /// Index of the word that holds the scales of `group` for the quad of `row`.
    const fn scale_at(self, row: usize, group: usize) -> usize {
        let last = (group + 1) * self.units_per_group();
        let units = if last < self.units() { last } else { self.units() };
        (row / QUAD) * self.quad_words() + units * self.width.unit().words * QUAD + group
    }
}

/// A block's words in place, of exactly the length that its shape asks for.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    shape: BlockShape,
    words: &'a [u32],
}

impl<'a> Block<'a> {
    /// Pairs `words` (little-endian words as they stand in the image) with their shape; `None` where the shape is not
    /// valid or the length differs from [`BlockShape::words`].
    pub fn new(shape: BlockShape, words: &'a [u32]) -> Option<Self> {
        (shape.is_valid() && words.len() == shape.words()).then_some(Self { shape, words })
    }

    /// The shape.
    pub fn shape(&self) -> BlockShape {
        self.shape
    }

    /// The words of the quads from `first_quad` on; empty when out of range.
    pub fn quads_from(&self, first_quad: usize) -> &'a [u32] {
        self.words.get(first_quad.saturating_mul(self.shape.quad_words())..).unwrap_or(&[])
    }

    /// The code at (`row`, `col`); 0 when out of range.
    pub fn code(&self, row: usize, col: usize) -> u8 {
        match self.shape.width {
            Width::W2 => self.code_of::<w2::W2>(row, col),
            Width::W3 => self.code_of::<w3::W3>(row, col),
            Width::W4 => self.code_of::<w4::W4>(row, col),
            Width::W8 => self.code_of::<w8::W8>(row, col),
        }
    }

    fn code_of<F: Format>(&self, row: usize, col: usize) -> u8 {
        let at = self.shape.unit_at(row, col / F::UNIT.cols);
        let mut unit = [0u32; 3];
        for (k, word) in unit.iter_mut().enumerate().take(F::UNIT.words) {
            *word = u32::from_le(self.words.get(at + k * QUAD).copied().unwrap_or(0));
        }
        F::extract(&unit, col % F::UNIT.cols)
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
                let word = self.words.get(self.shape.scale_at(row, col / group)).copied().unwrap_or(0);
                (u32::from_le(word) >> (8 * (row % QUAD))) as u8
            }
        }
    }
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
    match shape.width {
        Width::W2 => pack_codes::<w2::W2>(shape, codes, out),
        Width::W3 => pack_codes::<w3::W3>(shape, codes, out),
        Width::W4 => pack_codes::<w4::W4>(shape, codes, out),
        Width::W8 => pack_codes::<w8::W8>(shape, codes, out),
    }
    if shape.groups() > 0 {
        for (row, row_scales) in scales.chunks_exact(shape.groups()).enumerate() {
            for (group, &scale) in row_scales.iter().enumerate() {
                out[shape.scale_at(row, group)] |= (scale as u32) << (8 * (row % QUAD));
            }
        }
    }
    for word in out.iter_mut() {
        *word = word.to_le();
    }
    Some(())
}

fn pack_codes<F: Format>(shape: BlockShape, codes: &[u8], out: &mut [u32]) {
    for (row, row_codes) in codes.chunks_exact(shape.cols).enumerate() {
        for (unit, unit_codes) in row_codes.chunks(F::UNIT.cols).enumerate() {
            let mut words = [0u32; 3];
            for (col, &code) in unit_codes.iter().enumerate() {
                F::insert(&mut words, col, code);
            }
            for (k, &word) in words.iter().enumerate().take(F::UNIT.words) {
                out[shape.unit_at(row, unit) + k * QUAD] = word;
            }
        }
    }
}
