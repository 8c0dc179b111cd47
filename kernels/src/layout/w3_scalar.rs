//! 3-bit codes for cores without the DSP extension: one bit plane a word, exactly 3 bits a weight.
//!
//! As [`super::w2_scalar`], with three planes.

use super::format::{Cell, Format, Kernel, STRIP, Sums, XLayout, plane_code, set_plane_code};
use super::width::Width;

/// The 3-bit layout without lanes.
pub struct W3Scalar;

const _: () = assert!(W3Scalar::CELL.is_full(W3Scalar::WIDTH.bits()));

impl Format for W3Scalar {
    const WIDTH: Width = Width::W3;
    const CELL: Cell = Cell { rows: 4, cols: 8, words: 3 };
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
