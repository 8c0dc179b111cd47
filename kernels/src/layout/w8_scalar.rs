//! 8-bit codes for cores without the DSP extension: one multiplication computes the products of two rows.
//!
//! Word `c` of a cell holds column `c` of four rows, with an offset of 128. `word & 0x00ff_00ff` is rows 0 and 1, 16
//! bits apart, and `word >> 8` rows 2 and 3:
//!
//! ```text
//! bits  31-24  23-16  15-8   7-0
//! row     3      1      2     0
//! ```
//!
//! The products of two columns are `t = low + 2^16*high`. They start from `(1 + 2^16) * -128*(x0 + x1) + 0x8000`: both
//! halves are sums of `level * x`, the low one with a bias, at most `128 * 127 * 2 = 32512` away from the middle. All
//! of `t` is added to one sum modulo 2^32, and `t >> 16` to another. The first minus `2^16` times the second and
//! the biases is the sum of all low halves.

use super::format::{Cell, Format, STRIP, Sums, XLayout};
use super::half::halves;
use super::width::Width;

/// A column of two rows.
const MASK: u32 = 0x00ff_00ff;

/// The 8-bit layout without lanes.
pub struct W8Scalar;

const _: () = assert!(W8Scalar::CELL.is_full(W8Scalar::WIDTH.bits()));
const _: () = assert!(Width::W8.max_level() * 127 * (W8Scalar::CELL.cols as i32) < 0x8000);

impl Format for W8Scalar {
    const WIDTH: Width = Width::W8;
    const CELL: Cell = Cell { rows: 4, cols: 2, words: 2 };
    const STRIP: usize = STRIP;
    const STEP: usize = 8;
    const PASS: usize = 2;
    const X: XLayout = XLayout::PLAIN;

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (col, 8 * (row / 2) + 16 * (row % 2), 0x80)
    }

    #[inline(always)]
    fn start(_: &[u32]) -> Sums {
        [0; 4]
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        let Some(&x) = x.first() else { return };
        let (even, odd) = halves(x);
        let start = 0x8000i32.wrapping_sub((even + odd).wrapping_mul(128 * 0x1_0001));
        let product = |word: u32, x: i32| ((word & MASK) as i32).wrapping_mul(x);
        for (sums, shift) in t.chunks_exact_mut(2).zip([0, 8]) {
            let both = product(words[0] >> shift, even).wrapping_add(product(words[1] >> shift, odd));
            let both = both.wrapping_add(start);
            sums[0] = sums[0].wrapping_add(both);
            sums[1] = sums[1].wrapping_add(both >> 16);
        }
    }

    #[inline(always)]
    fn finish(t: &Sums, cols: usize, rows: &mut [i32]) {
        let biases = (cols as i32 / 2).wrapping_mul(0x8000);
        for (rows, sums) in rows.chunks_exact_mut(2).zip(t.chunks_exact(2)) {
            rows[0] = rows[0].wrapping_add(sums[0]).wrapping_sub(sums[1] << 16).wrapping_sub(biases);
            rows[1] = rows[1].wrapping_add(sums[1]);
        }
    }
}
