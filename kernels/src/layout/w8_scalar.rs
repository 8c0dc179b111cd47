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

use super::format::{Cell, Format, Kernel, QUAD, Sums, XLayout};
use super::width::Width;

/// A column of two rows.
#[cfg(not(actq_loops))]
pub(crate) const MASK: u32 = 0x00ff_00ff;

/// The 8-bit layout without lanes.
pub struct W8Scalar;

const _: () = assert!(W8Scalar::CELL.is_full(W8Scalar::WIDTH.bits()));
const _: () = assert!(Width::W8.max_level() * 127 * (W8Scalar::CELL.cols as i32) < 0x8000);

impl Format for W8Scalar {
    const WIDTH: Width = Width::W8;
    const CELL: Cell = Cell { rows: 4, cols: 2, words: 2 };
    const STRIP: usize = QUAD;
    const STEP: usize = 8;
    const KERNEL: Kernel = Kernel::Bytes;
    const X: XLayout = XLayout::PLAIN;

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (col, 8 * (row / 2) + 16 * (row % 2), 0x80)
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
