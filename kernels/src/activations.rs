//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! The **one rounding rule** of the project is round half to even, and it is computed by adding `1.5 * 2^23`: for `|v| < 2^22`
//! the sum's low mantissa bits are the rounded value in two's complement. It is one FPU addition, and the same bits everywhere.
//!
//! A prepared vector is made for the layout that reads it ([`XFormat`]): for each group of columns (the whole row where the
//! weights have no group scales) its chunks, and behind them, where the layout asks for it, the sum of the row's values, or, in
//! both halves of a word, of the group's. Where the layout takes groups in pairs, a pair is prepared as a group of two chunks,
//! and the halves of its word are their sums. A chunk is its start words and its int16 pairs, column `2j` in the low half. Zeros
//! fill the last group (and, in pairs, the place of one that a last group lacks), or, where there are no groups, a kernel's step
//! ([`PAD_COLS`] with single lanes). A [`Plan`] has all lengths.

use crate::format::{Block, BlockShape, Layout, PAD_COLS, XFormat, div_down, div_up, round_up};

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;

/// Vectors whose largest magnitude is below this (2^-100) count as zero, so that the reciprocal of the scale stays finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// How a vector is prepared for blocks of a shape, and what their kernels are told of it. Groups and chunks are whole: zeros fill
/// them.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The shape; its rows do not matter.
    pub(crate) shape: BlockShape,
    pub(crate) layout: &'static Layout,
    /// Columns with the padding.
    pub(crate) padded: usize,
    /// Groups; 1 where the weights have no group scales.
    pub(crate) groups: usize,
    /// Chunks of a group.
    pub(crate) chunks: usize,
    /// Columns of a group's first chunk; the others have [`XFormat::chunk`].
    pub(crate) first: usize,
    /// Words of the prepared vector.
    words: usize,
    #[cfg(actq_armv7em)]
    told: Told,
}

/// What a kernel is told of a vector.
#[cfg(actq_armv7em)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Told {
    /// The words up to where it stops reading. Single lanes read no more than the block's own units; with row scales, the
    /// vector's sum stands behind the end, and behind a last group without a partner the pair's word.
    pub(crate) end: usize,
    /// Where chunks are summed without being taken apart, minus the biases of all of them; for single lanes with row scales 0;
    /// else the bytes of a group's first chunk.
    pub(crate) extra: usize,
    /// Steps that the first pass through the loop of a kernel for row scales leaves out, or the last pair of groups.
    pub(crate) skip: usize,
}

impl Plan {
    /// The plan for blocks of this shape, whose rows do not matter; `None` where it is not valid.
    pub const fn new(shape: BlockShape) -> Option<Self> {
        if shape.is_valid() { Some(Self::of_valid(shape)) } else { None }
    }

    /// The plan for a block.
    pub fn of(block: &Block<'_>) -> Self {
        Self::of_valid(block.shape())
    }

    /// Every call of a kernel comes through here; all lengths but the vector's are powers of two, so nothing is divided.
    #[inline(never)]
    const fn of_valid(shape: BlockShape) -> Self {
        let layout = shape.layout();
        let format = &layout.x;
        #[cfg_attr(
            not(actq_armv7em),
            expect(unused_variables, reason = "only the assembler is told of reads and runs")
        )]
        let (read, padded, group, groups, run) = if shape.group == 0 {
            let read = round_up(shape.cols, layout.step);
            let padded = round_up(read, layout.pad);
            (read, padded, padded, 1, format.run)
        } else {
            let read = round_up(shape.cols, shape.step());
            // Two groups where they are taken in pairs.
            let group = shape.group << format.pairs as u32;
            let padded = round_up(read, group);
            (read, padded, group, div_down(padded, group), format.run << format.pairs as u32)
        };
        let before = (group - 1) >> layout.chunk_log;
        let (chunks, first) = (before + 1, group - (before << layout.chunk_log));
        let starts = format.start_words;
        let words = padded / 2 + groups * (chunks * starts + format.sum as usize);
        Self {
            shape,
            layout,
            padded,
            groups,
            chunks,
            first,
            words,
            #[cfg(actq_armv7em)]
            told: Told {
                end: words - (padded - read) / 2 - (format.sum && shape.group == 0) as usize,
                extra: match shape.lanes {
                    _ if format.sum => 0usize.wrapping_sub(chunks * format.starts[0].bias as usize),
                    crate::format::Lanes::Single if shape.group == 0 => 0,
                    _ => 4 * starts + 2 * first,
                },
                // Passes and steps are powers of two, and chunks that are longer than a pass are whole passes.
                skip: (0usize.wrapping_sub(read) & (run - 1)) >> layout.step_log,
            },
        }
    }

    /// Whether what is prepared by this plan is for blocks of this shape.
    #[inline(always)]
    pub fn fits(&self, shape: BlockShape) -> bool {
        let BlockShape { width, lanes, rows: _, cols, group } = self.shape;
        (width, lanes, cols, group) == (shape.width, shape.lanes, shape.cols, shape.group)
    }

    /// Words of the prepared vector.
    pub const fn words(&self) -> usize {
        self.words
    }

    /// Words that preparing a vector of `len` values needs. A vector that does not fill its groups is copied first and filled
    /// up with zeros: to the end of the room, while the prepared words grow from its begin.
    pub const fn room(&self, len: usize) -> usize {
        if len == self.padded { self.words } else { self.words + self.padded / 2 }
    }

    /// Columns of a group.
    const fn group(&self) -> usize {
        self.first + (self.chunks - 1) * self.layout.x.chunk
    }

    /// Words of a group.
    const fn group_words(&self) -> usize {
        self.group() / 2 + self.chunks * self.layout.x.start_words + self.layout.x.sum as usize
    }

    /// Words of a chunk of so many columns.
    const fn chunk_words(&self, columns: usize) -> usize {
        self.layout.x.start_words + columns / 2
    }

    /// Words before the pair of column `col`.
    const fn words_before(&self, col: usize) -> usize {
        let (group, col) = (col / self.group(), col % self.group());
        let full_before = (col + self.layout.x.chunk - self.first) / self.layout.x.chunk;
        group * self.group_words() + (full_before + 1) * self.layout.x.start_words + col / 2
    }

    /// What the cost of preparing and of reading a vector depends on.
    pub(crate) const fn extent(&self) -> Extent {
        let passes = match (self.shape.group, self.layout.x.run) {
            (0, 1) => 0,
            (0, run) => div_up(self.padded, run),
            _ => self.groups,
        };
        Extent { columns: self.padded, groups: self.groups, chunks: self.groups * self.chunks, passes }
    }
}

/// See [`Plan::extent`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extent {
    /// Columns with the padding.
    pub(crate) columns: usize,
    /// Groups; 1 where the weights have no group scales.
    pub(crate) groups: usize,
    /// Chunks of all groups.
    pub(crate) chunks: usize,
    /// Passes through a kernel's loop that are more than a step of its columns: groups, or runs of a row.
    pub(crate) passes: usize,
}

/// A prepared vector.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<'a> {
    words: &'a [u32],
    plan: &'a Plan,
}

impl<'a> Prepared<'a> {
    /// Names a vector that [`Scale::quantize`] or [`prepare`] wrote by this plan to the first of `words`; `None` where they are
    /// fewer than [`Plan::words`].
    #[inline(always)]
    pub fn new(words: &'a [u32], plan: &'a Plan) -> Option<Self> {
        Some(Self { words: words.get(..plan.words)?, plan })
    }

    /// How the vector was prepared.
    #[inline(always)]
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// All words.
    #[inline(always)]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// The groups' words, each with its sum where the layout has one.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &'a [u32]> {
        self.words.chunks(self.plan.group_words())
    }

    /// The chunks of a group's words, without its sum.
    pub(crate) fn chunks(&self, group: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
        let (first, rest) = group.split_at(self.plan.chunk_words(self.plan.first).min(group.len()));
        core::iter::once(first).chain(rest.chunks(self.plan.chunk_words(self.plan.layout.x.chunk)))
    }

    /// What the assembler is told about the vector.
    #[cfg(actq_armv7em)]
    #[inline(always)]
    pub(crate) fn told(&self) -> Told {
        self.plan.told
    }

    /// The value of column `col`; 0 when out of range.
    pub fn value(&self, col: usize) -> i16 {
        if col >= self.plan.padded {
            return 0;
        }
        let word = self.words.get(self.plan.words_before(col)).copied().unwrap_or(0);
        ((word >> (16 * (col % 2))) as i16) >> self.plan.layout.x.shift
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
    /// Takes integers as they are.
    pub(crate) const ONE: Self = Self { scale: 1.0, inverse: 1.0 };

    /// The scale of `x` for integers in `-x_max ..= x_max`. `x_max` is 127 for int8 activations and at most 32767.
    pub fn new(x: &[f32], x_max: u16) -> Result<Self, NotFinite> {
        let bits = magnitude_bits(x);
        if bits >= f32::INFINITY.to_bits() {
            return Err(NotFinite);
        }
        if bits < TINY.to_bits() {
            return Ok(Self { scale: 0.0, inverse: 0.0 });
        }
        let (amax, x_max) = (f32::from_bits(bits), f32::from(x_max));
        Ok(Self { scale: amax / x_max, inverse: x_max / amax })
    }

    /// The factor of the integers.
    pub fn get(self) -> f32 {
        self.scale
    }

    /// Writes the integers of `x` as `plan` has it to the first [`Plan::words`] words of `out`, and names them. Missing values of
    /// `x` count as zeros. `None`, with nothing written, where `out` is shorter than [`Plan::room`]; all of that may be
    /// overwritten.
    #[inline(never)]
    pub fn quantize<'w>(self, x: &[f32], plan: &'w Plan, out: &'w mut [u32]) -> Option<Prepared<'w>> {
        let x = x.get(..plan.shape.cols).unwrap_or(x);
        let room = out.get_mut(..plan.room(x.len()))?;
        #[cfg(actq_fpu)]
        crate::armv7em::quantize(x, self.inverse, plan, room);
        #[cfg(not(actq_fpu))]
        lay_out(x, plan, room, |value: f32| (value * self.inverse + ROUND).to_bits());
        Prepared::new(out, plan)
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

/// As [`Scale::quantize`], of integers.
pub fn prepare<'w>(x: &[i16], plan: &'w Plan, out: &'w mut [u32]) -> Option<Prepared<'w>> {
    let x = x.get(..plan.shape.cols).unwrap_or(x);
    lay_out(x, plan, out.get_mut(..plan.words)?, |value| value as u16 as u32);
    Prepared::new(out, plan)
}

/// Lays a vector out: any values, of which `integer` makes integers whose low 16 bits count.
fn lay_out<V: Copy>(x: &[V], plan: &Plan, out: &mut [u32], integer: impl Fn(V) -> u32) {
    let mut x = x;
    for group in out.chunks_exact_mut(plan.group_words()).take(plan.groups) {
        let (mut chunks, sum_word) = group.split_at_mut(group.len() - usize::from(plan.layout.x.sum));
        let (mut sum, mut last) = (0i32, 0);
        let mut columns = plan.first;
        while !chunks.is_empty() {
            let (this, rest) = chunks.split_at_mut(plan.chunk_words(columns).min(chunks.len()));
            let (this_x, rest_x) = x.split_at(columns.min(x.len()));
            last = chunk(this_x, &plan.layout.x, this, &integer);
            sum = sum.wrapping_add(last);
            (x, chunks, columns) = (rest_x, rest, plan.layout.x.chunk);
        }
        if let Some(word) = sum_word.first_mut() {
            // A pair's groups are chunks; without pairs, both halves are the group's.
            let first = if plan.layout.x.pairs { sum.wrapping_sub(last) } else { sum };
            let second = if plan.layout.x.pairs { last } else { sum };
            let halves = (first & 0xffff) | second << 16;
            *word = if plan.shape.group == 0 { sum } else { halves } as u32;
        }
    }
}

/// Writes a chunk, as far as `x` goes and then zeros, and returns the sum of its integers.
fn chunk<V: Copy>(x: &[V], format: &XFormat, out: &mut [u32], integer: &impl Fn(V) -> u32) -> i32 {
    let (starts, pairs) = out.split_at_mut(format.start_words.min(out.len()));
    let (whole, rest) = x.as_chunks::<2>();
    let odd = rest.first().map(|low| (integer(*low), 0));
    let values = whole.iter().map(|[low, high]| (integer(*low), integer(*high))).chain(odd);
    let mut sum = 0i32;
    let filled = x.len().div_ceil(2).min(pairs.len());
    for (word, (low, high)) in pairs.iter_mut().zip(values) {
        sum = sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
        *word = ((low << format.shift) & 0xffff) | (high << format.shift << 16);
    }
    pairs.iter_mut().skip(filled).for_each(|word| *word = 0);
    for (word, start) in starts.iter_mut().zip(format.starts) {
        *word = start.bias.wrapping_add(start.factor.wrapping_mul(sum)) as u32;
    }
    sum
}

/// Words that suffice to prepare a vector for blocks of any layout that has such groups: the most that [`Plan::room`] gives. That
/// is with chunks of eight columns and a sum, or where single lanes or pairs of groups need more columns.
pub const fn max_prepared_words(cols: usize, group: usize) -> usize {
    // Pairs of the columns up to a multiple of `unit`, and of a copy, where that has more columns.
    const fn pairs(cols: usize, unit: usize) -> usize {
        let padded = round_up(cols, unit);
        if padded == cols { padded / 2 } else { padded }
    }
    if group == 0 {
        let (single, paired) = (pairs(cols, PAD_COLS), pairs(cols, 8) + div_up(cols, 8));
        return 1 + if single > paired { single } else { paired };
    }
    let others = if group == 32 { 5 } else { 1 };
    let words = pairs(cols, group) + div_up(cols, group) * others;
    // Groups of 32 in pairs: two start words and the word of the sums.
    let in_pairs = if group == 32 { pairs(cols, 2 * group) + div_up(cols, 2 * group) * 3 } else { 0 };
    if words > in_pairs { words } else { in_pairs }
}
