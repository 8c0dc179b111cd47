//! 3-bit codes, single lanes: three words hold 32 columns of a row, exactly 3 bits a weight.
//!
//! Pair `j` is columns `2j` (low lane) and `2j + 1` (high lane). A 16-bit lane holds five 3-bit fields and one spare
//! bit. Word `k` holds pairs `5k` to `5k + 4`; the three words' spare bits hold pair 15, bit `k` of its code in word
//! `k`. In word `k` the spare bit is bit `k + 1`, where it already has the weight of bit `k` of a **doubled**
//! code, so one AND with an immediate extracts it; the five fields follow it around the 32-bit ring:
//!
//! ```text
//! word k, low lane:   bit k+1: spare    bits k+2 .. k+4: pair 5k    k+5 .. k+7: pair 5k+1   ..   k+14 .. k+16: pair 5k+4
//!         high lane:  the same, 16 bits further (modulo 32)
//! ```
//!
//! `ror(word, k + 1 + 3f) & 0x000e_000e` is field `f` doubled; `word & (0x0002_0002 << k)` is the share of pair 15.

use super::format::{Cell, Format, QUAD, Sums, XLayout, smlad};
use super::width::Width;

/// The doubled code of both lanes.
const MASK: u32 = 0x000e_000e;
/// The spare bit of word 0, both lanes.
const SPARE: u32 = 0x0002_0002;
/// Whole fields in a lane.
const FIELDS: usize = 5;

/// The 3-bit layout of single lanes.
pub struct W3;

const _: () = assert!(W3::CELL.is_full(W3::WIDTH.bits()));

impl Format for W3 {
    const WIDTH: Width = Width::W3;
    const CELL: Cell = Cell { rows: 1, cols: 32, words: 3 };
    const STRIP: usize = QUAD;
    const STEP: usize = 32;
    const X: XLayout = XLayout::single(-7);

    fn place(_row: usize, col: usize) -> (usize, usize, u32) {
        let (word, field) = (col / 2 / FIELDS, col / 2 % FIELDS);
        // The last pair is doubled.
        let first = if word == W3::CELL.words { 1 } else { word + 2 + 3 * field };
        (word, first + 16 * (col % 2), 0)
    }

    fn parts([w0, w1, w2]: [u32; 3]) -> [u32; 8] {
        let last = w0 & SPARE | w1 & SPARE << 1 | w2 & SPARE << 2;
        [w0, w1, w2, last, 0, 0, 0, 0]
    }

    fn whole([w0, w1, w2, last, ..]: [u32; 8]) -> [u32; 3] {
        [w0 | last & SPARE, w1 | last & SPARE << 1, w2 | last & SPARE << 2]
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        let last = x.last().copied().unwrap_or(0);
        for (k, (&word, x)) in words.iter().zip(x.chunks_exact(FIELDS)).enumerate() {
            for (f, &x) in x.iter().enumerate() {
                t[0] = smlad(word.rotate_right((k + 1 + 3 * f) as u32) & MASK, x, t[0]);
            }
            t[0] = smlad(word & (SPARE << k), last, t[0]);
        }
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        rows[0] = rows[0].wrapping_add(t[0]);
    }
}
