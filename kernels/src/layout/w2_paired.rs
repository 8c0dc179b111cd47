//! 2-bit codes, paired lanes: one word holds 8 columns of two rows, exactly 2 bits a weight.
//!
//! A lane holds the code of the even row in bits 0 and 1, unsigned, and that of the odd row in bits 14 and 15, as a
//! signed `code - 2`. Pair `j` (columns `2j`, `2j + 1`) is rotated left by `4j`, so that
//! `ror(word, 4j) & 0xc003_c003` is both lanes of the pair: one AND and one SMLAD for four MACs. Around the 32-bit
//! ring, before the rotation:
//!
//! ```text
//! bit   31 30   29 .. 18   17 16   15 14   13 .. 2   1  0
//!       odd row            even    odd               even      bits 0-15: column 2j; bits 16-31: column 2j + 1
//! ```
//!
//! With `x << 2`, a sum over SMLADs is `t = 4*even + 2^16*odd`. It starts from `0x8000 - 6*sum(x)`, so that it holds
//! `4*sum((code - 1.5) * x) + 0x8000` in its low half: at most `4 * 1.5 * 127 * 32 = 24384` away from the middle after
//! a chunk of 32 columns, so the low half never borrows, and `t >> 16` is exactly the odd row's `sum((code - 2) * x)`.
//! Chunks are summed without separation: the high halves in one sum, and all of `t` modulo 2^32 in another, from which
//! the sum of the high halves is subtracted at the end. The even row's level sum is then half of the rest, and the odd
//! row's is `2*odd + sum(x)`.
//!
//! With group scales, two groups' low halves without the bias and their high halves, at most `2 * 127 * 32 = 8128`, are
//! pairs of int16 that one SMLAD each multiplies with both groups' scales (the odd rows' doubled: 510 at most). The
//! sums over groups are modulo 2^32. The even row's is twice its level sum, at most `2 * 3 * 127 * 255` a column, which
//! fits an int32 up to [`MAX_PAIRED_GROUPED`] columns, and no block has more.

use super::format::{Cell, Format, STRIP, Start, Sums, XLayout, smlad};
use super::lanes::MAX_PAIRED_GROUPED;
use super::width::Width;

/// The codes of both rows in both lanes.
const MASK: u32 = 0xc003_c003;

/// The 2-bit layout of paired lanes.
pub struct W2Paired;

const _: () = assert!(W2Paired::CELL.is_full(W2Paired::WIDTH.bits()));
const _: () = assert!(2 * 3 * 127 * 255 * (MAX_PAIRED_GROUPED as i64) < 1 << 31);
const _: () = assert!(W2Paired::X.starts[0].factor.abs() * 127 * (W2Paired::X.chunk as i32) < 0x8000);

impl Format for W2Paired {
    const WIDTH: Width = Width::W2;
    const CELL: Cell = Cell { rows: 2, cols: 8, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 8;
    const X: XLayout = XLayout {
        shift: 2,
        run: 32,
        chunk: 32,
        start_words: 1,
        starts: [Start { bias: 0x8000, factor: -6 }, Start::NONE],
        sum: true,
        bytes: false,
        pairs: true,
    };

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        let bit = 4 * (col / 2) + 16 * (col % 2);
        if row == 0 { (0, bit, 0) } else { (0, bit + 14, 2) }
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        for (j, &x) in x.iter().enumerate() {
            t[0] = smlad(words[0].rotate_right(4 * j as u32) & MASK, x, t[0]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        let even = (t[0] & 0xffff) - 0x8000;
        rows[0] = rows[0].wrapping_add(even >> 1);
        rows[1] = rows[1].wrapping_add(2 * (t[0] >> 16));
    }
}
