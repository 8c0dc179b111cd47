//! 4-bit codes, paired lanes: one word holds 2 columns of four rows, exactly 4 bits a weight.
//!
//! Rows `a`, `b`, `c`, `d`; `b` and `d` as signed `code - 8`. Columns 0 and 1 are the lanes:
//!
//! ```text
//! bits   31-28  27-24  23-20  19-16  15-12  11-8   7-4   3-0
//! row      b      c      d      a      b      c     d     a
//! col      1      1      0      1      0      0     1     0
//! ```
//!
//! `word & 0xf00f_f00f` is `a + 2^12*b` in each lane, `ror(word, 8) & 0xf00f_f00f` is `c + 2^12*d`, and
//! `word & 0x0f0f_0f0f` is `a + 2^8*c`: three SMLADs for eight MACs. With `x << 1` and start values that cancel
//! the offsets, the three sums are
//!
//! ```text
//! p = A + 2^12*B,   q = C + 2^12*D,   k = A + 2^8*C    (modulo 2^32; A to D: the rows' sums of level * x)
//! ```
//!
//! `p` and `q` may wrap, for `k - 2^8*q = A - 2^20*D` gives `A` from its low 20 bits, and then `C = (k - A) / 2^8`,
//! `B = (p - A) / 2^12` and `D = (q - C) / 2^12` are exact. That holds while all sums have 20 bits:
//! `15 * 127 * 256 = 487680` is below `2^19 = 524288`, so a chunk has up to 256 columns.

use super::format::{COMPACT, Cell, Format, STRIP, Start, Sums, XLayout, smlad};
use super::width::Width;

/// Rows a and b, or, rotated, c and d.
const MASK: u32 = 0xf00f_f00f;
/// Rows a and c.
const CHECK: u32 = 0x0f0f_0f0f;

/// The 4-bit layout of paired lanes.
pub struct W4Paired;

const _: () = assert!(W4Paired::CELL.is_full(W4Paired::WIDTH.bits()));
const _: () = assert!(Width::W4.max_level() * 127 * (W4Paired::X.chunk as i32) < 1 << 19);

impl Format for W4Paired {
    const WIDTH: Width = Width::W4;
    const CELL: Cell = Cell { rows: 4, cols: 2, words: 1 };
    const STRIP: usize = STRIP;
    const STEP: usize = 8;
    const X: XLayout = XLayout {
        shift: 1,
        run: if COMPACT { 8 } else { 32 },
        chunk: 256,
        // Even rows have codes, for 2*code - 15; odd rows code - 8, for 2*(code - 8) + 1.
        start_words: 2,
        starts: [Start { bias: 0, factor: -15 + (1 << 12) }, Start { bias: 0, factor: -15 - (15 << 8) }],
        sum: false,
        bytes: false,
        pairs: false,
    };

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        match row {
            0 => (0, 16 * col, 0),
            1 => (0, 16 * col + 12, 8),
            2 => (0, 16 * col + 8, 0),
            _ => (0, 20 - 16 * col, 8),
        }
    }

    fn start(starts: &[u32]) -> Sums {
        let start = |i: usize| starts.get(i).map_or(0, |w| *w as i32);
        [start(0), start(0), start(1), 0]
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], [p, q, k, _]: &mut Sums) {
        let x = x.first().copied().unwrap_or(0);
        *p = smlad(words[0] & MASK, x, *p);
        *q = smlad(words[0].rotate_right(8) & MASK, x, *q);
        *k = smlad(words[0] & CHECK, x, *k);
    }

    fn finish(&[p, q, k, _]: &Sums, _: usize, rows: &mut [i32]) {
        let a = k.wrapping_sub(q << 8) << 12 >> 12;
        let b = p.wrapping_sub(a) >> 12;
        let c = k.wrapping_sub(a) >> 8;
        let d = q.wrapping_sub(c) >> 12;
        for (row, sum) in rows.iter_mut().zip([a, b, c, d]) {
            *row = row.wrapping_add(sum);
        }
    }
}
