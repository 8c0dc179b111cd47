//! 4-bit codes, single lanes: one word holds 8 columns of a row, exactly 4 bits a weight.
//!
//! The layout is that of [`super::w2`], with four pairs a word: pair `j` is columns `2j` and `2j + 1`, its codes are at
//! bits `4j + 1` and `4j + 17` of a 32-bit ring, and `ror(word, 4j) & 0x001e_001e` is both doubled codes:
//!
//! ```text
//! bit  31-29 28-25 24-21 20-17 16-13 12-9 8-5 4-1 0
//! pair   3     2     1     0     3     2   1   0  3    (bits 1-16: even columns; bits 17-31 and 0: odd columns)
//! ```

use super::format::{Cell, Format, QUAD, Sums, XLayout, smlad};
use super::width::Width;

/// The doubled code of both lanes.
const MASK: u32 = 0x001e_001e;

/// The 4-bit layout of single lanes.
pub struct W4;

const _: () = assert!(W4::CELL.is_full(W4::WIDTH.bits()));

impl Format for W4 {
    const WIDTH: Width = Width::W4;
    const CELL: Cell = Cell { rows: 1, cols: 8, words: 1 };
    const STRIP: usize = QUAD;
    const STEP: usize = 8;
    const X: XLayout = XLayout::single(-15);

    fn place(_row: usize, col: usize) -> (usize, usize, u32) {
        (0, 1 + 4 * (col / 2) + 16 * (col % 2), 0)
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        for (j, &x) in x.iter().enumerate() {
            t[0] = smlad(words[0].rotate_right(4 * j as u32) & MASK, x, t[0]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        rows[0] = rows[0].wrapping_add(t[0]);
    }
}
