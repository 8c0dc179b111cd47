//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! The **one rounding rule** of the project is round half to even, and it is computed by adding `1.5 * 2^23`: for `|v| < 2^22`
//! the sum's low mantissa bits are the rounded value in two's complement. It is one FPU addition, and the same bits everywhere.
//!
//! A prepared vector is made for the layout that reads it ([`XFormat`]): for each group of columns (the whole row where the
//! weights have no group scales) its chunks, and behind them, where the layout asks for it, the sum of the group's values. A
//! chunk is its start words and its int16 pairs, column `2j` in the low half. The last chunk is padded with zeros, so that the
//! columns are a multiple of [`PAD_COLS`].

use crate::format::{BlockShape, PAD_COLS, XFormat};

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;

/// Vectors whose largest magnitude is below this (2^-100) count as zero, so that the reciprocal of the scale stays finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// How a prepared vector is laid out: the layout's needs, with the lengths of the vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Plan {
    format: XFormat,
    cols: usize,
    /// Columns with the padding.
    padded: usize,
    /// Columns of a group; all of them where there are no groups.
    group: usize,
    /// Columns of a chunk.
    chunk: usize,
}

impl Plan {
    const fn new(shape: BlockShape) -> Self {
        let format = shape.x_format();
        let padded = shape.cols.next_multiple_of(PAD_COLS);
        let group = if shape.group == 0 || shape.group > padded { padded } else { shape.group };
        let chunk = if format.chunk < group { format.chunk } else { group };
        Self { format, cols: shape.cols, padded, group, chunk }
    }

    const fn chunk_words(self) -> usize {
        self.format.starts.len() + self.chunk / 2
    }

    const fn group_words(self) -> usize {
        self.group / 2 + self.group.div_ceil(self.chunk) * self.format.starts.len() + self.format.sum as usize
    }

    /// Words before the pair of column `col`.
    const fn words_before(self, col: usize) -> usize {
        let (group, col) = (col / self.group, col % self.group);
        group * self.group_words() + (col / self.chunk + 1) * self.format.starts.len() + col / 2
    }

    const fn words(self) -> usize {
        // The last pair of the vector is followed by its group's sum only.
        self.words_before(self.padded - 1) + 1 + self.format.sum as usize
    }
}

/// Words of a prepared vector for a block of this shape.
pub const fn prepared_words(shape: BlockShape) -> usize {
    Plan::new(shape).words()
}

/// A prepared vector.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<'a> {
    words: &'a [u32],
    plan: Plan,
}

impl<'a> Prepared<'a> {
    /// Names a vector that [`Scale::quantize`] or [`prepare`] wrote for blocks of this shape (their rows do not matter); `None` where
    /// the length differs from [`prepared_words`] or the shape is not valid.
    pub fn new(words: &'a [u32], shape: BlockShape) -> Option<Self> {
        (shape.is_valid() && words.len() == prepared_words(shape)).then_some(Self { words, plan: Plan::new(shape) })
    }

    /// Whether the vector was prepared for blocks of this shape.
    pub fn fits(&self, shape: BlockShape) -> bool {
        self.plan == Plan::new(shape)
    }

    /// All words.
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// The groups' words, each with its sum where the layout has one.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &'a [u32]> {
        self.words.chunks(self.plan.group_words())
    }

    /// Words of a full chunk, start words included.
    pub(crate) fn chunk_words(&self) -> usize {
        self.plan.chunk_words()
    }

    /// Words up to where the assembler stops reading x. Single lanes read no more than the block's own units; with row scales,
    /// the vector's sum is behind the end.
    #[cfg(actq_armv7em)]
    pub(crate) fn chunks_end(&self, shape: BlockShape) -> usize {
        let cols = (shape.units() * shape.cell().cols).max(1);
        let sum_inside = self.plan.format.sum && shape.group != 0;
        self.plan.words_before(cols - 1) + 1 + usize::from(sum_inside)
    }

    /// The kernels' last argument: bytes of a chunk, or, where chunks are summed without being taken apart, minus the biases
    /// of all chunks.
    #[cfg(actq_armv7em)]
    pub(crate) fn kernel_argument(&self) -> usize {
        if self.plan.format.sum {
            let bias = self.plan.format.starts.iter().map(|s| s.bias).sum::<i32>();
            let chunks = self.plan.padded.div_ceil(self.plan.chunk);
            0usize.wrapping_sub(chunks * bias as usize)
        } else {
            4 * self.plan.chunk_words()
        }
    }

    /// The value of column `col`; 0 when out of range.
    pub fn value(&self, col: usize) -> i16 {
        if col >= self.plan.padded {
            return 0;
        }
        let word = self.words.get(self.plan.words_before(col)).copied().unwrap_or(0);
        ((word >> (16 * (col % 2))) as i16) >> self.plan.format.shift
    }
}

/// A vector of f32 holds NaN or an infinity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite;

/// The scale of a vector: `x[i]` is about `scale * q[i]`, where `q[i] = round(x[i] * (x_max / amax))` and
/// `scale = amax / x_max`. It comes from the vector itself, so nothing saturates, whatever the observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    scale: f32,
    /// 0 for a vector that counts as zero.
    inverse: f32,
}

impl Scale {
    /// The scale of `x` for integers in `-x_max ..= x_max`. `x_max` is 127 for int8 activations and at most 32767.
    pub fn new(x: &[f32], x_max: u16) -> Result<Self, NotFinite> {
        let amax = f32::from_bits(magnitude_bits(x));
        if !amax.is_finite() {
            return Err(NotFinite);
        }
        let x_max = f32::from(x_max);
        Ok(if amax < TINY {
            Self { scale: 0.0, inverse: 0.0 }
        } else {
            Self { scale: amax / x_max, inverse: x_max / amax }
        })
    }

    /// The factor of the integers.
    pub fn get(self) -> f32 {
        self.scale
    }

    /// Writes the integers of `x`, prepared for blocks of `shape`, into `out`, which holds [`prepared_words`] words (a shorter
    /// `out` is filled as far as it goes). Missing values of `x` count as zeros.
    pub fn quantize(self, x: &[f32], shape: BlockShape, out: &mut [u32]) {
        fill(x, Plan::new(shape), out, |x, shift, out| quantize_pairs(x, self.inverse, shift, out));
    }
}

/// The bits of the largest magnitude; magnitudes compare as their bits, and anything from the infinity's bits up is not
/// finite.
fn magnitude_bits(x: &[f32]) -> u32 {
    #[cfg(actq_armv7em)]
    return crate::armv7em::magnitude_bits(x);
    #[cfg(not(actq_armv7em))]
    x.iter().fold(0u32, |m, v| m.max(v.to_bits() & 0x7fff_ffff))
}

/// Writes `round(x * inverse) << shift` as pairs and returns the sum of the rounded values. `out` holds the pairs exactly.
fn quantize_pairs(x: &[f32], inverse: f32, shift: u32, out: &mut [u32]) -> i32 {
    #[cfg(actq_fpu)]
    let (x, out, sum) = crate::armv7em::quantize_pairs(x, inverse, shift, out);
    #[cfg(not(actq_fpu))]
    let sum = 0;
    pairs(x, shift, out, |v| (v * inverse + ROUND).to_bits()).wrapping_add(sum)
}

/// Writes integers prepared for blocks of `shape` into `out`; lengths as for [`Scale::quantize`].
pub fn prepare(x: &[i16], shape: BlockShape, out: &mut [u32]) {
    fill(x, Plan::new(shape), out, |x, shift, out| pairs(x, shift, out, |v| v as u16 as u32));
}

/// Writes pairs; `value` gives an integer whose low 16 bits count. Returns the sum of the integers.
#[inline(always)]
fn pairs<T: Copy>(x: &[T], shift: u32, out: &mut [u32], value: impl Fn(T) -> u32) -> i32 {
    let mut sum = 0i32;
    for (pair, word) in x.chunks(2).zip(out) {
        let (low, high) = (value(pair[0]), pair.get(1).map_or(0, |v| value(*v)));
        sum = sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
        *word = ((low << shift) & 0xffff) | (high << shift << 16);
    }
    sum
}

/// Lays a vector out; `write(x, shift, out)` writes a chunk's pairs, as far as `x` goes, and returns the sum of their values.
#[inline(always)]
fn fill<T>(x: &[T], plan: Plan, mut out: &mut [u32], mut write: impl FnMut(&[T], u32, &mut [u32]) -> i32) {
    let x = x.get(..plan.cols).unwrap_or(x);
    let mut group_sum = 0i32;
    for first in (0..plan.padded).step_by(plan.chunk) {
        let last = (first + plan.chunk).min(plan.padded);
        let x = x.get(first..last).or(x.get(first..)).unwrap_or(&[]);
        let starts = plan.format.starts;
        let Some((chunk, rest)) = core::mem::take(&mut out).split_at_mut_checked(starts.len() + (last - first) / 2)
        else {
            return;
        };
        out = rest;
        let (start_words, pairs) = chunk.split_at_mut(starts.len());
        let (filled, padding) = pairs.split_at_mut(x.len().div_ceil(2));
        let sum = write(x, plan.format.shift, filled);
        padding.fill(0);
        for (word, start) in start_words.iter_mut().zip(starts) {
            *word = start.bias.wrapping_add(start.factor.wrapping_mul(sum)) as u32;
        }
        group_sum = group_sum.wrapping_add(sum);
        if plan.format.sum
            && (last.is_multiple_of(plan.group) || last == plan.padded)
            && let Some((word, rest)) = core::mem::take(&mut out).split_first_mut()
        {
            *word = group_sum as u32;
            group_sum = 0;
            out = rest;
        }
    }
}

/// Words that suffice for a prepared vector of any layout.
pub const fn max_prepared_words(cols: usize, group: usize) -> usize {
    use crate::format::{Lanes, Width};
    let mut most = 0;
    let mut i = 0;
    while i < Width::ALL.len() * Lanes::ALL.len() {
        let (width, lanes) = (Width::ALL[i / Lanes::ALL.len()], Lanes::ALL[i % Lanes::ALL.len()]);
        let words = prepared_words(BlockShape { width, lanes, rows: 1, cols, group });
        if words > most {
            most = words;
        }
        i += 1;
    }
    most
}
