//! 4-bit codes for cores without the DSP extension: one multiplication computes the products of two rows.
//!
//! One word holds 2 columns of four rows. `word >> 4k & 0x000f_000f` is two rows of a column, 16 bits apart:
//!
//! ```text
//! bits  31-28  27-24  23-20  19-16  15-12  11-8   7-4    3-0
//! row     3      1      3      1      2      0     2      0
//! col     1      1      0      0      1      1     0      0
//! ```
//!
//! A sum of products is `t = low + 2^16*high`. It starts from `(1 + 2^16) * -8*sum(x) + 0x8000`, so that both halves
//! are sums of `(code - 8) * x`, the low one with a bias: at most `8 * 127 * 32 = 32512` away from the middle after a
//! chunk of 32 columns, so it never borrows. A row's level sum is twice its half plus `sum(x)`, the second start word.

use super::format::{Cell, Format, Kernel, STRIP, Start, Sums, XLayout};
use super::width::Width;

/// A column of two rows.
pub(crate) const MASK: u32 = 0x000f_000f;

/// The 4-bit layout without lanes.
pub struct W4Scalar;

const _: () = assert!(W4Scalar::CELL.is_full(W4Scalar::WIDTH.bits()));
const _: () = assert!(8 * 127 * (W4Scalar::X.chunk as i32) < 0x8000);

impl Format for W4Scalar {
    const WIDTH: Width = Width::W4;
    const CELL: Cell = Cell { rows: 4, cols: 2, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 8;
    const KERNEL: Kernel = Kernel::Pairs;
    const X: XLayout = XLayout {
        chunk: 32,
        start_words: 2,
        starts: [Start { bias: 0x8000, factor: -8 * 0x1_0001 }, Start { bias: 0, factor: 1 }],
        ..XLayout::PLAIN
    };

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        (0, 8 * col + 4 * (row / 2) + 16 * (row % 2), 0)
    }

    fn mac(_: &[u32; 3], _: &[u32], _: &mut Sums) {}

    fn finish(_: &Sums, _: usize, _: &mut [i32]) {}
}
