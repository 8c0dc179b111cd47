//! 3-bit codes for Helium: three bytes hold two columns of four rows, exactly 3 bits a weight.
//!
//! Column `a` is one of the first four of a cell, `b` the fourth after it. Row 2 has its low bit apart from the others, which
//! are signed, `code / 2 - 2`:
//!
//! ```text
//! bits of a byte     7      6      5-3      2-0
//! word 0          2a, bits 2-1      1a       0a
//! word 1          2b, bits 2-1      1b       0b
//! word 2          2b, 0  2a, 0      3b       3a
//! ```
//!
//! As at 2 bits ([`super::w2_helium`]), no field is shifted and no sum wraps: `64 * 2 * 127 * 65535` is below `2^31`. Words 0
//! and 1, each with its columns of x, add to the same three sums.

use super::format::{Cell, Format, Kernel, QUAD, Sums, XLayout};
use super::width::Width;

/// The 3-bit layout for Helium.
pub struct W3Helium;

const _: () = assert!(W3Helium::CELL.is_full(W3Helium::WIDTH.bits()));

impl Format for W3Helium {
    const WIDTH: Width = Width::W3;
    const CELL: Cell = Cell { rows: 4, cols: 8, words: 3 };
    const STRIP: usize = QUAD;
    const STEP: usize = 32;
    const X: XLayout = XLayout::BYTES;
    const KERNEL: Kernel = Kernel::Vectors;

    /// Row 2 of [`Self::parts`] is in parts of its own.
    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        let (byte, half) = (8 * (col % 4), col / 4);
        match row {
            0 => (half, byte, 0),
            1 => (half, byte + 3, 0),
            2 => (3 + half, byte, 0b100),
            _ => (2, byte + 3 * half, 0),
        }
    }

    fn parts([w0, w1, w2]: [u32; 3]) -> [u32; 8] {
        const TOP: u32 = 0xc0c0_c0c0;
        let code = |top: u32, low: u32| (top & TOP) >> 5 | (low & 0x0101_0101);
        [w0 & !TOP, w1 & !TOP, w2 & !TOP, code(w0, w2 >> 6), code(w1, w2 >> 7), 0, 0, 0]
    }

    fn whole([w0, w1, w2, a, b, ..]: [u32; 8]) -> [u32; 3] {
        const LOW: u32 = 0x0101_0101;
        let top = |code: u32| (code & !LOW) << 5;
        [w0 | top(a), w1 | top(b), w2 | (a & LOW) << 6 | (b & LOW) << 7]
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
