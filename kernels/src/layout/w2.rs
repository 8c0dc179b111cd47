//! 2-bit codes, single lanes: one word holds 16 columns of a row, exactly 2 bits a weight.
//!
//! Columns are paired for SMLAD: pair `j` is columns `2j` (low lane) and `2j + 1` (high lane). Its codes are at bits
//! `2j + 1` and `2j + 17` of a 32-bit ring, so that `ror(word, 2j) & 0x0006_0006` is both **doubled** codes, each in
//! its lane:
//!
//! ```text
//! bit  31 30 29 .. 19 18 17 16 15 14 .. 4 3 2 1  0
//! pair  7  6  6 ..  1  0  0  7  7  6 .. 1 1 0 0  7    (bits 1-16: even columns; bits 17-31 and 0: odd columns)
//! ```

use super::format::{Cell, Format, QUAD, Sums, XLayout, smlad};
use super::width::Width;

/// The doubled code of both lanes.
const MASK: u32 = 0x0006_0006;

/// The 2-bit layout of single lanes.
pub struct W2;

const _: () = assert!(W2::CELL.is_full(W2::WIDTH.bits()));

impl Format for W2 {
    const WIDTH: Width = Width::W2;
    const CELL: Cell = Cell { rows: 1, cols: 16, words: 1 };
    const STRIP: usize = QUAD;
    const STEP: usize = 16;
    const X: XLayout = XLayout::single(-3);

    fn place(_row: usize, col: usize) -> (usize, usize, u32) {
        (0, 1 + 2 * (col / 2) + 16 * (col % 2), 0)
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        for (j, &x) in x.iter().enumerate() {
            t[0] = smlad(words[0].rotate_right(2 * j as u32) & MASK, x, t[0]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        rows[0] = rows[0].wrapping_add(t[0]);
    }
}
