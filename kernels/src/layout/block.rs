//! A block of rows in place: its shape, its words, and where each code and scale stands.

use super::format::QUAD;
#[cfg(feature = "writer")]
use super::format::{Cell, Format, STRIP};
use super::lanes::{Lanes, MAX_PAIRED_GROUPED, PAIRED_GROUP, is_group};
use super::pow2::{div_down, div_up, round_up};
#[cfg(feature = "writer")]
use super::table::with_format;
use super::table::{LAYOUTS, Layout};
use super::width::Width;

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
    /// Columns that share a u8 scale, one of [`GROUPS`](super::GROUPS); 0 = none, the row's scale alone.
    pub group: usize,
}

impl BlockShape {
    /// Whether the lengths are usable: rows and columns from 1 to 65535 and a group that the lanes know; with groups in
    /// paired lanes at most [`MAX_PAIRED_GROUPED`] columns.
    pub const fn is_valid(self) -> bool {
        let (group, cols) = match self.lanes {
            Lanes::Single => (is_group(self.group), 0xffff),
            Lanes::Paired => (self.group == 0 || self.group == PAIRED_GROUP, MAX_PAIRED_GROUPED),
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
    #[inline(always)]
    pub(crate) const fn step(self, layout: &Layout) -> usize {
        match (self.lanes, self.group) {
            (Lanes::Paired, 1..) => self.group,
            _ => layout.step,
        }
    }

    /// Units in a row.
    pub const fn units(self) -> usize {
        self.units_in(self.layout())
    }

    #[inline(always)]
    const fn units_in(self, layout: &Layout) -> usize {
        round_up(self.cols, self.step(layout)) >> layout.unit_log
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
        let layout = self.layout();
        self.units_in(layout) * layout.quad_words + self.groups()
    }

    /// Words of the block.
    #[cfg(feature = "writer")]
    pub const fn words(self) -> usize {
        self.padded_rows() / QUAD * self.quad_words()
    }

    /// First row and rows of the strip that `row` is in.
    #[cfg(feature = "writer")]
    const fn strip(self, row: usize) -> (usize, usize) {
        let height = self.layout().strip;
        let first = row & !(height - 1);
        let left = self.padded_rows() - first;
        (first, if left < height { left } else { height })
    }

    /// Index of the first word of a cell and the distance to its next word: the cell that holds `row` in unit `unit`.
    #[cfg(feature = "writer")]
    pub(super) const fn cell_at(self, row: usize, unit: usize) -> (usize, usize) {
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
    #[cfg(feature = "writer")]
    const fn in_pairs(self, height: usize) -> bool {
        self.layout().x.pairs && height == STRIP
    }

    /// Index of the word that holds the scale of `group` for `row`, and the scale's first bit.
    #[cfg(feature = "writer")]
    pub(super) const fn scale_at(self, row: usize, group: usize) -> (usize, usize) {
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
    #[cfg(feature = "writer")]
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
    #[cfg(feature = "writer")]
    pub fn code(&self, row: usize, col: usize) -> u8 {
        if row >= self.shape.rows || col >= self.shape.cols {
            return 0;
        }
        let Cell { rows, cols, .. } = self.shape.layout().cell;
        let cell = self.cell(row, div_down(col, cols));
        with_format!(self.shape, extract::<_>(&cell, row & (rows - 1), col & (cols - 1)))
    }

    /// The words of the cell that holds `row` in unit `unit`.
    #[cfg(feature = "writer")]
    fn cell(&self, row: usize, unit: usize) -> [u32; 3] {
        let (at, step) = self.shape.cell_at(row, unit);
        let mut cell = [0u32; 3];
        for (k, word) in cell.iter_mut().enumerate().take(self.shape.layout().cell.words) {
            *word = u32::from_le(self.words.get(at + k * step).copied().unwrap_or(0));
        }
        cell
    }

    /// The level at (`row`, `col`), without any scale.
    #[cfg(feature = "writer")]
    pub fn level(&self, row: usize, col: usize) -> i32 {
        self.shape.width.level(self.code(row, col))
    }

    /// The u8 scale that (`row`, `col`) is multiplied with; 1 where the block has no group scales.
    #[cfg(feature = "writer")]
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

#[cfg(feature = "writer")]
fn extract<F: Format>(words: &[u32; 3], row: usize, col: usize) -> u8 {
    F::extract(words, row, col)
}
