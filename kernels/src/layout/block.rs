//! A block of rows in place: its shape, its words, and the place of each code and scale.

use super::format::QUAD;
use super::format::{Cell, Format, STRIP};
use super::lanes::{Lanes, MAX_PAIRED_GROUPED, PAIRED_GROUP, is_group};
use super::pow2::{div_down, div_up, round_up};
use super::table::with_format;
use super::table::{LAYOUTS, Layout};
use super::width::Width;

/// The shape of a [`Block`]: rows of one width.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockShape {
    /// Code width.
    pub width: Width,
    /// Weights in each lane.
    pub lanes: Lanes,
    /// Rows, at least 1.
    pub rows: usize,
    /// Columns, at least 1.
    pub cols: usize,
    /// Group size, one of [`GROUPS`](super::GROUPS); 0 for row scales only.
    pub group: usize,
}

impl BlockShape {
    /// Returns `true` if the lengths are valid: rows and columns from 1 to 65535 and a group size of the lanes; with
    /// group scales in paired lanes at most [`MAX_PAIRED_GROUPED`] columns.
    pub const fn is_valid(self) -> bool {
        let (group, cols) = match self.lanes {
            Lanes::Single => (is_group(self.group), 0xffff),
            Lanes::Paired => (self.group == 0 || self.group == PAIRED_GROUP, MAX_PAIRED_GROUPED),
            #[cfg(feature = "scalar")]
            Lanes::Scalar => (is_group(self.group), 0xffff),
            #[cfg(feature = "helium")]
            Lanes::Helium => (is_group(self.group), 0xffff),
        };
        let cols = if self.group == 0 { 0xffff } else { cols };
        self.rows >= 1 && self.rows <= 0xffff && self.cols >= 1 && self.cols <= cols && group
    }

    /// Returns `true` if rows have group scales: in a build without them, at compile time.
    #[inline(always)]
    pub(crate) const fn has_groups(self) -> bool {
        cfg!(any(feature = "groups", feature = "writer")) && self.group != 0
    }

    /// Returns the layout, of a width and lanes that the build has.
    #[inline(always)]
    pub(crate) const fn layout(self) -> &'static Layout {
        &LAYOUTS[self.width.index()][self.lanes.index()]
    }

    /// Returns the rows of a strip: [`QUAD`] or [`STRIP`](super::STRIP).
    pub(crate) const fn strip_rows(self) -> usize {
        self.layout().strip
    }

    /// Returns the columns of a unit.
    pub(crate) const fn cell_cols(self) -> usize {
        self.layout().cell.cols
    }

    /// Returns the rows with padding.
    pub const fn padded_rows(self) -> usize {
        self.rows.next_multiple_of(QUAD)
    }

    /// Returns the columns to whose multiple rows are padded. With paired lanes, all groups are whole.
    #[inline(always)]
    pub(crate) const fn step(self, layout: &Layout) -> usize {
        match (self.lanes, self.group) {
            (Lanes::Paired, 1..) => self.group,
            _ => layout.step,
        }
    }

    /// Returns the columns with padding.
    #[cfg(actq_helium)]
    pub(crate) const fn padded_cols(self) -> usize {
        round_up(self.cols, self.layout().step)
    }

    /// Returns the units of a row.
    pub const fn units(self) -> usize {
        self.units_in(self.layout())
    }

    #[inline(always)]
    const fn units_in(self, layout: &Layout) -> usize {
        round_up(self.cols, self.step(layout)) >> layout.unit_log
    }

    /// Returns the units of a full group; all units of a row without group scales.
    #[inline(never)]
    pub const fn units_per_group(self) -> usize {
        match self.group {
            0 => self.units(),
            group => div_down(group, self.layout().cell.cols),
        }
    }

    /// Returns the group scales of a row; 0 without group scales.
    pub const fn groups(self) -> usize {
        match self.group {
            0 => 0,
            group => div_up(self.cols, group),
        }
    }

    /// Returns the words of four rows, with scales; a strip of eight has twice that.
    #[inline(never)]
    pub const fn quad_words(self) -> usize {
        let layout = self.layout();
        self.units_in(layout) * layout.quad_words + self.groups()
    }

    /// Returns the words of the block.
    pub const fn words(self) -> usize {
        self.padded_rows() / QUAD * self.quad_words()
    }

    /// Returns the first row and the number of rows of the strip that holds `row`.
    const fn strip(self, row: usize) -> (usize, usize) {
        let height = self.layout().strip;
        let first = row & !(height - 1);
        let left = self.padded_rows() - first;
        (first, if left < height { left } else { height })
    }

    /// Returns the index of the first word of the cell that holds `row` in unit `unit`, and the distance to its next
    /// word.
    pub(super) const fn cell_at(self, row: usize, unit: usize) -> (usize, usize) {
        let (first, height) = self.strip(row);
        let Cell { rows, words, .. } = self.layout().cell;
        // The words of four units of a cell, one of each, are a vector: the others follow in its place.
        let vector = if self.layout().x.has_bytes() { 4 } else { 1 };
        let (units_before, in_vector) = (unit & !(vector - 1), unit & (vector - 1));
        let groups_before = match self.group {
            0 => 0,
            _ => div_down(unit, self.units_per_group()),
        };
        // The scales of a pair follow its second group.
        let groups_before = if self.in_pairs(height) { groups_before & !1 } else { groups_before };
        let scales_before = groups_before * (height / QUAD);
        let step = div_down(height, rows);
        let strip = first / QUAD * self.quad_words();
        let cell = div_down(row - first, rows);
        (strip + units_before * words * step + scales_before + vector * cell + in_vector, vector * step)
    }

    /// Returns `true` if the scales of a strip of `height` rows follow pairs of groups.
    const fn in_pairs(self, height: usize) -> bool {
        self.layout().x.pairs && height == STRIP
    }

    /// Returns the index of the word that holds the scale of `group` for `row`, and the scale's first bit.
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

/// A block's words in place, of exactly the length of its shape.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    shape: BlockShape,
    quad_words: usize,
    words: &'a [u32],
}

impl<'a> Block<'a> {
    /// Combines `words` (little-endian, as in the image) with their shape; `None` if the shape is not valid or the
    /// length differs from [`BlockShape::words`].
    pub fn new(shape: BlockShape, words: &'a [u32]) -> Option<Self> {
        if !shape.is_valid() {
            return None;
        }
        Self::leading(shape, words).filter(|block| block.words.len() == words.len())
    }

    /// Returns the block of a valid shape at the start of `words`; `None` if words are missing.
    #[inline(always)]
    pub(crate) fn leading(shape: BlockShape, words: &'a [u32]) -> Option<Self> {
        let quad_words = shape.quad_words();
        let words = words.get(..div_up(shape.rows, QUAD) * quad_words)?;
        Some(Self { shape, quad_words, words })
    }

    /// Returns the shape.
    pub fn shape(&self) -> BlockShape {
        self.shape
    }

    /// Returns [`BlockShape::quad_words`].
    pub fn quad_words(&self) -> usize {
        self.quad_words
    }

    /// Returns all words.
    #[inline(always)]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// Returns the words of the rows from `first_row` on, a multiple of [`STRIP`](super::STRIP); empty when out of
    /// range.
    pub fn rows_from(&self, first_row: usize) -> &'a [u32] {
        self.words.get((first_row / QUAD).saturating_mul(self.quad_words)..).unwrap_or(&[])
    }

    /// Returns the code at (`row`, `col`); 0 when out of range.
    pub fn code(&self, row: usize, col: usize) -> u8 {
        if row >= self.shape.rows || col >= self.shape.cols {
            return 0;
        }
        let Cell { rows, cols, .. } = self.shape.layout().cell;
        let cell = self.cell(row, div_down(col, cols));
        with_format!(self.shape, extract::<_>(cell, row & (rows - 1), col & (cols - 1)))
    }

    /// Returns the words of the cell that holds `row` in unit `unit`.
    fn cell(&self, row: usize, unit: usize) -> [u32; 3] {
        let (at, step) = self.shape.cell_at(row, unit);
        let mut cell = [0u32; 3];
        for (k, word) in cell.iter_mut().enumerate().take(self.shape.layout().cell.words) {
            *word = u32::from_le(self.words.get(at + k * step).copied().unwrap_or(0));
        }
        cell
    }

    /// Returns the level at (`row`, `col`), without any scale.
    pub fn level(&self, row: usize, col: usize) -> i32 {
        self.shape.width.level(self.code(row, col))
    }

    /// Returns the group scale of (`row`, `col`); 1 without group scales.
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

fn extract<F: Format>(words: [u32; 3], row: usize, col: usize) -> u8 {
    F::extract(words, row, col)
}
