//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! The **one rounding rule** of the project is round half to even, and it is computed by adding `1.5 * 2^23`: for `|v| < 2^22`
//! the sum's low mantissa bits are the rounded value in two's complement. It is one FPU addition, and the same bits everywhere.
//!
//! A prepared vector is, for each group of columns (the whole row where the weights have no group scales), one word with the
//! sum of the group's values, then its int16 pairs, column `2j` in the low half. The last group is padded with zeros to a
//! multiple of [`PAD_COLS`] columns. The kernels derive each width's zero-point correction from the sum.

use crate::format::PAD_COLS;

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;

/// Vectors whose largest magnitude is below this (2^-100) count as zero, so that the reciprocal of the scale stays finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// Words of a prepared vector of `cols` values for weights with scale groups of `group` columns (0: none).
pub const fn prepared_words(cols: usize, group: usize) -> usize {
    let groups = match group {
        0 => 1,
        group => cols.div_ceil(group),
    };
    groups + cols.next_multiple_of(PAD_COLS) / 2
}

/// A prepared vector.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<'a> {
    pub(crate) words: &'a [u32],
    pub(crate) cols: usize,
    pub(crate) group: usize,
}

impl<'a> Prepared<'a> {
    /// Names a vector that [`quantize`] or [`prepare`] wrote for the same `cols` and `group`; `None` where the length differs
    /// from [`prepared_words`].
    pub fn new(words: &'a [u32], cols: usize, group: usize) -> Option<Self> {
        (words.len() == prepared_words(cols, group)).then_some(Self { words, cols, group })
    }

    /// The value of column `col`; 0 when out of range.
    pub fn value(&self, col: usize) -> i16 {
        let group = col.checked_div(self.group).unwrap_or(0);
        let word = self.words.get(1 + group + col / 2).copied().unwrap_or(0);
        (word >> (16 * (col % 2))) as i16
    }
}

/// A vector of f32 holds NaN or an infinity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite;

/// Quantizes `x` to integers in `-x_max ..= x_max` and writes them prepared into `out`, which holds
/// [`prepared_words`]`(x.len(), group)` words (a shorter `out` is filled as far as it goes). Returns the scale: `x[i]` is
/// about `scale * q[i]`, where `q[i] = round(x[i] * (x_max / amax))` and `scale = amax / x_max`.
///
/// The scale comes from the vector itself, so nothing saturates, whatever the observation. `x_max` is 127 for int8
/// activations and at most 32767.
pub fn quantize(x: &[f32], x_max: u16, group: usize, out: &mut [u32]) -> Result<f32, NotFinite> {
    // Magnitudes compare as their bits; anything from the infinity's bits up is not finite.
    let amax = x.iter().fold(0u32, |m, v| m.max(v.to_bits() & 0x7fff_ffff));
    if amax >= f32::INFINITY.to_bits() {
        return Err(NotFinite);
    }
    let amax = f32::from_bits(amax);
    if amax < TINY {
        out.fill(0);
        return Ok(0.0);
    }
    let x_max = f32::from(x_max);
    let inverse = x_max / amax;
    fill(x, group, out, |v| (v * inverse + ROUND).to_bits());
    Ok(amax / x_max)
}

/// Writes integers prepared into `out`; lengths as for [`quantize`].
pub fn prepare(x: &[i16], group: usize, out: &mut [u32]) {
    fill(x, group, out, |v| v as u16 as u32);
}

/// `value` gives an integer whose low 16 bits count.
#[inline(always)]
fn fill<T: Copy>(x: &[T], group: usize, out: &mut [u32], value: impl Fn(T) -> u32) {
    let group = if group == 0 { x.len().max(1) } else { group };
    let mut out = out.iter_mut();
    for x in x.chunks(group) {
        let Some(sum_word) = out.next() else { return };
        let mut sum = 0i32;
        let pairs = x.chunks_exact(2);
        let odd = pairs.remainder();
        for (pair, word) in pairs.zip(out.by_ref()) {
            let (low, high) = (value(pair[0]), value(pair[1]));
            sum = sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
            *word = (low & 0xffff) | (high << 16);
        }
        if let &[last] = odd {
            let low = value(last);
            sum = sum.wrapping_add(low as i16 as i32);
            if let Some(word) = out.next() {
                *word = low & 0xffff;
            }
        }
        *sum_word = sum as u32;
    }
    out.for_each(|word| *word = 0);
}
