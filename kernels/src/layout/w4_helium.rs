//! 4-bit codes for Helium: a byte holds a column of two rows, exactly 4 bits a weight.
//!
//! The low four bits are the even row, the high ones the odd row as signed `code - 8`. As at 2 bits ([`super::w2_helium`]),
//! `w & 15` gives the sum of the even row, and `w` that and 16 times the odd row's. No sum wraps: `16 * 8 * 127 * 65535` is
//! below `2^31`.

use super::format::{Cell, Format, Kernel, STRIP, Sums, XLayout};
use super::width::Width;

/// The 4-bit layout for Helium.
pub struct W4Helium;

const _: () = assert!(W4Helium::CELL.is_full(W4Helium::WIDTH.bits()));
const _: () = assert!(16 * 8 * 127 * (u16::MAX as u32) < 1 << 31);

impl Format for W4Helium {
    const WIDTH: Width = Width::W4;
    const CELL: Cell = Cell { rows: 2, cols: 4, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 16;
    const X: XLayout = XLayout::BYTES;
    const KERNEL: Kernel = Kernel::Vectors;

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * col + 4 * row, 8 * row as u32)
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
