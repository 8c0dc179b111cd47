//! 2-bit codes for Helium: a byte holds a column of four rows, exactly 2 bits a weight.
//!
//! Row 3 as signed `code - 2`:
//!
//! ```text
//! bits of a byte   7-6   5-4   3-2   1-0
//! row               3     2     1     0
//! ```
//!
//! No field is shifted. With `w` the signed bytes, `w & 3`, `w & 12` and `w & 48` give `A0`, `4 A1` and `16 A2`, sums of
//! `code * x`, and `w` itself their sum and `64 A3`. A level sum is `2 A - 3 sum(x)`; of row 3, `2 A3 + sum(x)`. No sum
//! wraps: `64 * 2 * 127 * 65535` is below `2^31`.

use super::format::{Cell, Format, Kernel, STRIP, Sums, XLayout};
use super::width::Width;

/// The 2-bit layout for Helium.
pub struct W2Helium;

const _: () = assert!(W2Helium::CELL.is_full(W2Helium::WIDTH.bits()));
const _: () = assert!(64 * 2 * 127 * (u16::MAX as u32) < 1 << 31);

impl Format for W2Helium {
    const WIDTH: Width = Width::W2;
    const CELL: Cell = Cell { rows: 4, cols: 4, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 16;
    const X: XLayout = XLayout::BYTES;
    const KERNEL: Kernel = Kernel::Vectors;

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * col + 2 * row, if row == 3 { 0b10 } else { 0 })
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
