//! 8-bit codes, paired lanes: one word holds 2 columns of two rows.
//!
//! A lane holds the even row in its low byte, unsigned with an offset of 128, and the odd row in its high byte, signed:
//!
//! ```text
//! bits   31-24  23-16  15-8   7-0
//! row     odd   even   odd    even
//! col      1      1     0      0
//! ```
//!
//! SMLAD of the word itself sums `even + 2^8*odd`, SMLAD of its UXTB16 sums `even`: three instructions for four
//! MACs. Both start from `-128 * sum(x)`, and the odd row's sum is their difference over 2^8. It has 24 bits as long as
//! `128 * 127 * 512 = 8323072` is below `2^23 = 8388608`: a chunk has up to 512 columns.

use super::format::{COMPACT, Cell, Format, QUAD, Start, Sums, XLayout, smlad};
use super::width::Width;

/// The even row in both lanes, as UXTB16 extracts it.
const EVEN: u32 = 0x00ff_00ff;

/// The 8-bit layout of paired lanes.
pub struct W8Paired;

const _: () = assert!(W8Paired::CELL.is_full(W8Paired::WIDTH.bits()));
const _: () = assert!(Width::W8.max_level() * 127 * (W8Paired::X.chunk as i32) < 1 << 23);

impl Format for W8Paired {
    const WIDTH: Width = Width::W8;
    const CELL: Cell = Cell { rows: 2, cols: 2, words: 1 };
    const STRIP: usize = QUAD;
    const STEP: usize = 8;
    const X: XLayout = XLayout {
        shift: 0,
        run: if COMPACT { 8 } else { 64 },
        chunk: 512,
        start_words: 1,
        starts: [Start { bias: 0, factor: -128 }, Start::NONE],
        sum: false,
        bytes: false,
        pairs: false,
    };

    fn place(row: usize, col: usize) -> (usize, usize, u32) {
        if row == 0 { (0, 16 * col, 0x80) } else { (0, 16 * col + 8, 0) }
    }

    #[inline(always)]
    fn mac(words: &[u32; 3], x: &[u32], t: &mut Sums) {
        let x = x.first().copied().unwrap_or(0);
        t[0] = smlad(words[0] & EVEN, x, t[0]);
        t[1] = smlad(words[0], x, t[1]);
    }

    fn finish(t: &Sums, _: usize, rows: &mut [i32]) {
        rows[0] = rows[0].wrapping_add(t[0]);
        rows[1] = rows[1].wrapping_add(t[1].wrapping_sub(t[0]) >> 8);
    }
}
