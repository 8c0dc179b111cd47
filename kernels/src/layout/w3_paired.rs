//! 3-bit codes, paired lanes: three words hold 8 columns of four rows, exactly 3 bits a weight.
//!
//! A **set** is a pair of columns in two rows: a lane holds the even row's code in bits 0 to 2, unsigned, and the odd
//! row's in bits 13 to 15, as a signed `code - 4`. A cell has eight sets: set `2j + p` is columns `2j`, `2j + 1` of
//! rows `2p`, `2p + 1`. Word `k` holds set `2k`, and set `2k + 1` rotated left by 6, each extracted by an AND with
//! `0xe007_e007`:
//!
//! ```text
//! bit   31-29   28-25   24-22   21-19   18-16   15-13   12-9    8-6     5-3     2-0
//! set    2k     spare   2k+1    2k+1     2k      2k     spare   2k+1    2k+1    2k
//! ```
//!
//! The last two sets are in the spare bits of all three words: set 6 is
//! `ror(w0 ^ ror(w1, 2), 10) & 0xe007_e007`, set 7 is `ror(w2 ^ ror(w1, 4), 10) & 0xe007_e007`. Of the 12 bits that
//! each expression reads, 8 are spare in `w0` (`w2`); the other 4 are spare in `w1` only, bits 9 and 10 for set 6,
//! bits 11 and 12 for set 7 (and 16 further). The packer solves `w1` first, then `w0` and `w2`.
//!
//! With `x << 3`, a sum over SMLADs is `t = 8*even + 2^16*odd`. It starts from `0x8000 - 28*sum(x)`, so that its low
//! half holds `8*sum((code - 3.5) * x) + 0x8000`: at most `8 * 3.5 * 127 * 8 = 28448` away from the middle after a
//! chunk of 8 columns. The rest is as in [`super::w2_paired`].

use super::format::{COMPACT, Cell, Format, QUAD, Start, Sums, XLayout, smlad};
use super::width::Width;

/// The codes of a set.
const MASK: u32 = 0xe007_e007;
/// Bits 7 and 8 of both lanes: those of a rotated last set that are not spare in `w0` and `w2`.
const TAKEN: u32 = 0x0180_0180;
/// Bits 9 to 12 of both lanes.
const SPARE: u32 = 0x1e00_1e00;

/// The 3-bit layout of paired lanes.
pub struct W3Paired;

const _: () = assert!(W3Paired::CELL.is_full(W3Paired::WIDTH.bits()));
const _: () = assert!(W3Paired::X.starts[0].factor.abs() * 127 * (W3Paired::X.chunk as i32) < 0x8000);

/// Returns the sets of a cell, its parts.
const fn sets([w0, w1, w2]: [u32; 3]) -> [u32; 8] {
    [
        w0 & MASK,
        w0.rotate_right(6) & MASK,
        w1 & MASK,
        w1.rotate_right(6) & MASK,
        w2 & MASK,
        w2.rotate_right(6) & MASK,
        (w0 ^ w1.rotate_right(2)).rotate_right(10) & MASK,
        (w2 ^ w1.rotate_right(4)).rotate_right(10) & MASK,
    ]
}

impl Format for W3Paired {
    const WIDTH: Width = Width::W3;
    const CELL: Cell = Cell { rows: 4, cols: 8, words: 3 };
    const STRIP: usize = QUAD;
    const STEP: usize = 8;
    const X: XLayout = XLayout {
        shift: 3,
        run: if COMPACT { 32 } else { 64 },
        chunk: 8,
        start_words: 1,
        starts: [Start { bias: 0x8000, factor: -28 }, Start::NONE],
        sum: true,
        bytes: false,
        pairs: false,
    };

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        let (set, bit) = (2 * (col / 2) + row / 2, 16 * (col % 2));
        if row.is_multiple_of(2) { (set, bit, 0) } else { (set, bit + 13, 4) }
    }

    fn parts(words: [u32; 3]) -> [u32; 8] {
        sets(words)
    }

    fn whole(sets: [u32; 8]) -> [u32; 3] {
        let mut w0 = sets[0] | sets[1].rotate_left(6);
        let mut w1 = sets[2] | sets[3].rotate_left(6);
        let mut w2 = sets[4] | sets[5].rotate_left(6);
        let (last0, last2) = (sets[6].rotate_left(10), sets[7].rotate_left(10));
        w1 |= ((last0 ^ w0) & TAKEN).rotate_left(2) | ((last2 ^ w2) & TAKEN).rotate_left(4);
        w0 |= (last0 ^ w1.rotate_right(2)) & SPARE;
        w2 |= (last2 ^ w1.rotate_right(4)) & SPARE;
        [w0, w1, w2]
    }

    #[inline(always)]
    fn mac(cell: &[u32; 3], x: &[u32], t: &mut Sums) {
        for (sets, &x) in sets(*cell).chunks_exact(2).zip(x) {
            t[0] = smlad(sets[0], x, t[0]);
            t[1] = smlad(sets[1], x, t[1]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        for (rows, t) in rows.chunks_exact_mut(2).zip(t) {
            let even = (t & 0xffff) - 0x8000;
            rows[0] = rows[0].wrapping_add(even >> 2);
            rows[1] = rows[1].wrapping_add(2 * (t >> 16));
        }
    }
}
