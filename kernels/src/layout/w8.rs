//! 8-bit codes, single lanes, two's complement: one word holds 4 columns of a row.
//!
//! Bytes 0 and 2 are columns 0 and 1, bytes 1 and 3 are columns 2 and 3, so that SXTB16 of the word and of the word
//! rotated by 8 are the two pairs, signed, each value in its lane:
//!
//! ```text
//! byte    3   2   1   0
//! column  3   1   2   0
//! ```

use super::format::{Cell, Format, QUAD, Sums, XLayout, smlad};
use super::width::Width;

/// The 8-bit layout of single lanes.
pub struct W8;

const _: () = assert!(W8::CELL.is_full(W8::WIDTH.bits()));

/// Sign-extends bytes 0 and 2 into the two lanes, as SXTB16 does.
#[inline(always)]
fn sxtb16(word: u32) -> u32 {
    (word as i8 as i16 as u16 as u32) | (((word >> 16) as i8 as i16 as u16 as u32) << 16)
}

impl Format for W8 {
    const WIDTH: Width = Width::W8;
    const CELL: Cell = Cell { rows: 1, cols: 4, words: 1 };
    const STRIP: usize = QUAD;
    const STEP: usize = 4;
    const X: XLayout = XLayout::single(0);

    fn place(_row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * (col / 2) + 16 * (col % 2), 0)
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        for (j, &x) in x.iter().enumerate() {
            t[0] = smlad(sxtb16(words[0] >> (8 * j)), x, t[0]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        rows[0] = rows[0].wrapping_add(t[0]);
    }
}
