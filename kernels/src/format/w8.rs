//! 8-bit codes, two's complement: one word holds 4 columns of a row.
//!
//! Bytes 0 and 2 are columns 0 and 1, bytes 1 and 3 are columns 2 and 3, so that SXTB16 of the word and of the word rotated
//! by 8 are the two pairs, signed, each value in its lane:
//!
//! ```text
//! byte    3   2   1   0
//! column  3   1   2   0
//! ```

use super::{Format, QUAD, Unit, Width, smlad};

/// Bits of a code.
pub const BITS: u32 = 8;
/// One word, 4 columns.
pub const UNIT: Unit = Unit { cols: 4, words: 1 };
const _: () = assert!(UNIT.cols * BITS as usize == 32 * UNIT.words);

/// The 8-bit layout.
pub struct W8;

/// Where a column's code starts in the word.
const fn bit(col: usize) -> u32 {
    8 * (col as u32 / 2) + 16 * (col as u32 % 2)
}

/// Sign-extends bytes 0 and 2 into the two lanes: what SXTB16 computes.
#[inline(always)]
fn sxtb16(word: u32) -> u32 {
    (word as i8 as i16 as u16 as u32) | (((word >> 16) as i8 as i16 as u16 as u32) << 16)
}

impl Format for W8 {
    const UNIT: Unit = UNIT;
    const WIDTH: Width = Width::W8;

    fn insert(words: &mut [u32], col: usize, code: u8) {
        words[0] |= (code as u32) << bit(col);
    }

    fn extract(words: &[u32], col: usize) -> u8 {
        (words[0] >> bit(col)) as u8
    }

    #[inline(always)]
    fn mac_quad(words: &[u32], x: &[u32], t: &mut [i32; QUAD]) {
        for (j, &x) in x.iter().enumerate() {
            for (t, &word) in t.iter_mut().zip(words) {
                *t = smlad(sxtb16(u32::from_le(word) >> (8 * j)), x, *t);
            }
        }
    }
}
