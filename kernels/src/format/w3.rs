//! 3-bit codes: three words hold 32 columns of a row, exactly 3 bits a weight.
//!
//! Pair `j` is columns `2j` (low lane) and `2j + 1` (high lane). A 16-bit lane holds five 3-bit fields and one spare bit.
//! Word `k` holds pairs `5k` to `5k + 4`; the three words' spare bits hold pair 15, bit `k` of its code in word `k`. In word
//! `k` the spare bit stands at bit `k + 1`, where it already has the weight of bit `k` of a **doubled** code, so one AND
//! with an immediate extracts it; the five fields follow it around the 32-bit ring:
//!
//! ```text
//! word k, low lane:   bit k+1: spare    bits k+2 .. k+4: pair 5k    k+5 .. k+7: pair 5k+1   ..   k+14 .. k+16: pair 5k+4
//!         high lane:  the same, 16 bits further (modulo 32)
//! ```
//!
//! `ror(word, k + 1 + 3f) & 0x000e_000e` is field `f` doubled; `word & (0x0002_0002 << k)` is the share of pair 15.

use super::{Format, QUAD, Unit, Width, smlad};

/// Bits of a code.
pub const BITS: u32 = 3;
/// Three words, 32 columns.
pub const UNIT: Unit = Unit { cols: 32, words: 3 };
const _: () = assert!(UNIT.cols * BITS as usize == 32 * UNIT.words);

/// The doubled code of both lanes.
const MASK: u32 = 0x000e_000e;
/// The spare bit of word 0, both lanes.
const SPARE: u32 = 0x0002_0002;
/// Whole fields in a lane.
const FIELDS: usize = 5;

/// The 3-bit layout.
pub struct W3;

/// Word and first bit of a column's code, for the pairs 0 to 14.
const fn field(col: usize) -> (usize, u32) {
    let (word, field) = (col / 2 / FIELDS, col / 2 % FIELDS);
    (word, (word as u32 + 2 + 3 * field as u32 + 16 * (col as u32 % 2)) % 32)
}

/// The spare bit of word `k` in the lane of `col`.
const fn spare(k: usize, col: usize) -> u32 {
    k as u32 + 1 + 16 * (col as u32 % 2)
}

impl Format for W3 {
    const UNIT: Unit = UNIT;
    const WIDTH: Width = Width::W3;

    fn insert(words: &mut [u32], col: usize, code: u8) {
        if col / 2 < FIELDS * UNIT.words {
            let (word, bit) = field(col);
            words[word] |= (code as u32 & 7).rotate_left(bit);
        } else {
            for (k, word) in words.iter_mut().enumerate().take(UNIT.words) {
                *word |= (code as u32 >> k & 1) << spare(k, col);
            }
        }
    }

    fn extract(words: &[u32], col: usize) -> u8 {
        if col / 2 < FIELDS * UNIT.words {
            let (word, bit) = field(col);
            (words[word].rotate_right(bit) & 7) as u8
        } else {
            (0..UNIT.words).map(|k| ((words[k] >> spare(k, col) & 1) << k) as u8).sum()
        }
    }

    #[inline(always)]
    fn mac_quad(words: &[u32], x: &[u32], t: &mut [i32; QUAD]) {
        let last = x.last().copied().unwrap_or(0);
        for (k, (words, x)) in words.chunks_exact(QUAD).zip(x.chunks_exact(FIELDS)).enumerate() {
            for (f, &x) in x.iter().enumerate() {
                for (t, &word) in t.iter_mut().zip(words) {
                    *t = smlad(u32::from_le(word).rotate_right((k + 1 + 3 * f) as u32) & MASK, x, *t);
                }
            }
            for (t, &word) in t.iter_mut().zip(words) {
                *t = smlad(u32::from_le(word) & (SPARE << k), last, *t);
            }
        }
    }
}
