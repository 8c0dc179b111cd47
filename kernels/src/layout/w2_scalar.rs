//! 2-bit codes for cores without the DSP extension: one bit plane a word, exactly 2 bits a weight.
//!
//! A cell is 4 rows of 8 columns. Word `p` has bit `p` of every code, a byte for each row: an index into a table of the
//! sums `±x0 ±x1 .. ±x7` (`arch/portable/planes.rs`). A strip of eight has two cells next to each other, so its
//! rows are eight bytes of plane 0, then eight of plane 1:
//!
//! ```text
//! bits  31-24  23-16  15-8   7-0
//! row     3      2      1     0      bit `c` of a byte: column `c`
//! ```

use super::format::{Cell, Format, Kernel, STRIP, Sums, XLayout, plane_code, set_plane_code};
use super::width::Width;

/// The 2-bit layout without lanes.
pub struct W2Scalar;

const _: () = assert!(W2Scalar::CELL.is_full(W2Scalar::WIDTH.bits()));

impl Format for W2Scalar {
    const WIDTH: Width = Width::W2;
    const CELL: Cell = Cell { rows: 4, cols: 8, words: 2 };
    const STRIP: usize = STRIP;
    const STEP: usize = 8;
    const X: XLayout = XLayout::PLAIN;
    const KERNEL: Kernel = Kernel::Planes;

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * row + col, 0)
    }

    fn insert(words: &mut [u32; 3], row: usize, col: usize, code: u8) {
        set_plane_code::<Self>(words, row, col, code);
    }

    fn extract(words: [u32; 3], row: usize, col: usize) -> u8 {
        plane_code::<Self>(words, row, col)
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
