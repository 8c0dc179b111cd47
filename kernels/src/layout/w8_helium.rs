//! 8-bit codes for Helium: a byte holds a column of a row, as it is.

use super::format::{Cell, Format, Kernel, STRIP, Sums, XLayout};
use super::width::Width;

/// The 8-bit layout for Helium.
pub struct W8Helium;

const _: () = assert!(W8Helium::CELL.is_full(W8Helium::WIDTH.bits()));

impl Format for W8Helium {
    const WIDTH: Width = Width::W8;
    const CELL: Cell = Cell { rows: 1, cols: 4, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 16;
    const X: XLayout = XLayout::BYTES;
    const KERNEL: Kernel = Kernel::Vectors;

    fn place(_row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * col, 0)
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
