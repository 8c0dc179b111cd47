//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! The **one rounding rule** of the project is round half to even, and it is computed by adding `1.5 * 2^23`: for `|v| < 2^22`
//! the sum's low mantissa bits are the rounded value in two's complement. It is one FPU addition, and the same bits everywhere.
//!
//! A prepared vector is made for the layout that reads it ([`XFormat`]): for each group of columns (the whole row where the
//! weights have no group scales) its chunks, and behind them, where the layout asks for it, the sum of the group's values. A
//! chunk is its start words and its int16 pairs, column `2j` in the low half. The last one is padded with zeros up to where the
//! weights are, or to a multiple of [`PAD_COLS`] with single lanes.

use crate::format::{BlockShape, Lanes, PAD_COLS, Start, XFormat};

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;

/// Vectors whose largest magnitude is below this (2^-100) count as zero, so that the reciprocal of the scale stays finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// How a prepared vector is laid out: the layout's needs, with the lengths of the vector.
#[derive(Clone, Copy)]
struct Plan {
    format: XFormat,
    cols: usize,
    /// Columns with the padding.
    padded: usize,
    /// Columns of a group; all of them where there are no groups.
    group: usize,
    /// Columns of a chunk.
    chunk: usize,
    /// Columns of a group's first chunk, which is short where they do not fill all.
    first_chunk: usize,
    /// Chunks of a group.
    chunks: usize,
}

impl Plan {
    const fn new(shape: BlockShape) -> Self {
        let format = shape.layout().x;
        let padded = match shape.lanes {
            Lanes::Single => shape.cols.next_multiple_of(PAD_COLS),
            Lanes::Paired => shape.units() * shape.layout().cell.cols,
        };
        let group = if shape.group == 0 || shape.group > padded { padded } else { shape.group };
        let chunk = if format.chunk < group { format.chunk } else { group };
        let full_chunks = group / chunk;
        let (first_chunk, chunks) = match group - full_chunks * chunk {
            0 => (chunk, full_chunks),
            short => (short, full_chunks + 1),
        };
        Self { format, cols: shape.cols, padded, group, chunk, first_chunk, chunks }
    }

    const fn chunk_words(self) -> usize {
        self.format.starts.len() + self.chunk / 2
    }

    const fn group_words(self) -> usize {
        self.group / 2 + self.chunks * self.format.starts.len() + self.format.sum as usize
    }

    /// Words before the pair of column `col`.
    const fn words_before(self, col: usize) -> usize {
        let (group, col) = (col / self.group, col % self.group);
        let full_before = (col + self.chunk - self.first_chunk) / self.chunk;
        group * self.group_words() + (full_before + 1) * self.format.starts.len() + col / 2
    }

    const fn words(self) -> usize {
        if self.padded == self.group {
            return self.group_words();
        }
        // The last pair of the vector is followed by its group's sum only.
        self.words_before(self.padded - 1) + 1 + self.format.sum as usize
    }

    /// See [`Prepared::bounds`]. Single lanes read no more than the block's own units; with row scales, the vector's sum
    /// stands behind the end.
    #[cfg(actq_armv7em)]
    const fn bounds(self, shape: BlockShape) -> (usize, usize) {
        let unread = (self.padded - shape.units() * shape.layout().cell.cols) / 2;
        let sum_behind = (self.format.sum && shape.group == 0) as usize;
        let extra = match self.format.starts {
            [start] if self.format.sum => 0usize.wrapping_sub(self.chunks * start.bias as usize),
            starts => 4 * (starts.len() + self.first_chunk / 2),
        };
        (self.words() - unread - sum_behind, extra)
    }

    /// Steps of 8 columns that the first pass through the loop of a kernel for row scales leaves out.
    #[cfg(actq_armv7em)]
    const fn skip(self) -> usize {
        // A pass takes several chunks where they are shorter. Passes are powers of two.
        let first = if self.format.chunk < self.format.run { self.padded } else { self.first_chunk };
        (0usize.wrapping_sub(first) & (self.format.run - 1)) / 8
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
    /// The shape without its rows.
    shape: BlockShape,
    #[cfg(actq_armv7em)]
    bounds: (usize, usize),
    #[cfg(actq_armv7em)]
    skip: usize,
}

impl<'a> Prepared<'a> {
    /// Names a vector that [`Scale::quantize`] or [`prepare`] wrote for blocks of this shape (their rows do not matter); `None` where
    /// the length differs from [`prepared_words`] or the shape is not valid.
    pub fn new(words: &'a [u32], shape: BlockShape) -> Option<Self> {
        let shape = BlockShape { rows: 1, ..shape };
        if !shape.is_valid() {
            return None;
        }
        let plan = Plan::new(shape);
        (words.len() == plan.words()).then_some(Self {
            words,
            shape,
            #[cfg(actq_armv7em)]
            bounds: plan.bounds(shape),
            #[cfg(actq_armv7em)]
            skip: plan.skip(),
        })
    }

    /// Whether the vector was prepared for blocks of this shape.
    pub fn fits(&self, shape: BlockShape) -> bool {
        self.shape == BlockShape { rows: 1, ..shape }
    }

    /// All words.
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// The groups' words, each with its sum where the layout has one.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &'a [u32]> {
        self.words.chunks(Plan::new(self.shape).group_words())
    }

    /// The chunks of a group's words, without its sum.
    pub(crate) fn chunks(&self, group: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
        let plan = Plan::new(self.shape);
        let first = plan.format.starts.len() + plan.first_chunk / 2;
        let (first, rest) = group.split_at(first.min(group.len()));
        core::iter::once(first).chain(rest.chunks(plan.chunk_words()))
    }

    /// What the assembler is told about the vector: the words up to where it stops reading, and either the bytes of the first chunk or,
    /// where chunks are summed without being taken apart, minus the biases of all chunks.
    #[cfg(actq_armv7em)]
    pub(crate) fn bounds(&self) -> (usize, usize) {
        self.bounds
    }

    /// Steps of 8 columns that the first pass through a kernel's loop leaves out.
    #[cfg(actq_armv7em)]
    pub(crate) fn skip(&self) -> usize {
        self.skip
    }

    /// The value of column `col`; 0 when out of range.
    pub fn value(&self, col: usize) -> i16 {
        let plan = Plan::new(self.shape);
        if col >= plan.padded {
            return 0;
        }
        let word = self.words.get(plan.words_before(col)).copied().unwrap_or(0);
        ((word >> (16 * (col % 2))) as i16) >> plan.format.shift
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
        let quantizer = Quantizer { inverse: self.inverse };
        fill(x, Plan::new(shape), out, &quantizer);
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

/// Writes integers prepared for blocks of `shape` into `out`; lengths as for [`Scale::quantize`].
pub fn prepare(x: &[i16], shape: BlockShape, out: &mut [u32]) {
    fill(x, Plan::new(shape), out, &Copier);
}

/// What turns values into the integers of a prepared vector.
trait Source {
    type Value: Copy;

    /// An integer whose low 16 bits count.
    fn integer(&self, value: Self::Value) -> u32;

    /// Writes `chunks` whole chunks of `cols` values, each with one start word, and returns the sum of their integers; `None`,
    /// with nothing written, where the backend has no code for that.
    fn chunks(
        &self,
        _x: &[Self::Value],
        _shift: u32,
        _start: Start,
        _counts: (usize, usize),
        _out: &mut [u32],
    ) -> Option<i32> {
        None
    }
}

struct Copier;

impl Source for Copier {
    type Value = i16;

    fn integer(&self, value: i16) -> u32 {
        value as u16 as u32
    }
}

struct Quantizer {
    inverse: f32,
}

impl Source for Quantizer {
    type Value = f32;

    #[inline(always)]
    fn integer(&self, value: f32) -> u32 {
        (value * self.inverse + ROUND).to_bits()
    }

    #[cfg(actq_fpu)]
    #[inline(always)]
    fn chunks(&self, x: &[f32], shift: u32, start: Start, counts: (usize, usize), out: &mut [u32]) -> Option<i32> {
        crate::armv7em::quantize(x, self.inverse, shift, start, counts, out)
    }
}

/// Lays a vector out.
#[inline(always)]
fn fill<S: Source>(x: &[S::Value], plan: Plan, out: &mut [u32], source: &S) {
    let XFormat { starts, sum, .. } = plan.format;
    let x = x.get(..plan.cols).unwrap_or(x);
    let mut groups = x.chunks(plan.group);
    for out in out.chunks_mut(plan.group_words()) {
        let (out, sum_word) = out.split_at_mut(out.len() - usize::from(sum));
        let (mut x, mut out) = (groups.next().unwrap_or(&[]), out);
        let mut group_sum = 0i32;
        let first = plan.first_chunk;
        if first != plan.chunk {
            let (first_x, rest_x) = x.split_at(first.min(x.len()));
            let (first_out, rest_out) = out.split_at_mut((starts.len() + first / 2).min(out.len()));
            group_sum = chunk(first_x, plan.format, first_out, source);
            (x, out) = (rest_x, rest_out);
        }
        // Whole chunks at once, where each has but one start word.
        if let [start] = *starts {
            let count = x.len() / plan.chunk;
            if let Some(sum) = source.chunks(x, plan.format.shift, start, (count, plan.chunk), out) {
                group_sum = group_sum.wrapping_add(sum);
                x = x.get(count * plan.chunk..).unwrap_or(&[]);
                out = out.get_mut(count * plan.chunk_words()..).unwrap_or_default();
            }
        }
        let mut chunks = x.chunks(plan.chunk);
        for out in out.chunks_mut(plan.chunk_words()) {
            group_sum = group_sum.wrapping_add(chunk(chunks.next().unwrap_or(&[]), plan.format, out, source));
        }
        if let Some(word) = sum_word.first_mut() {
            *word = group_sum as u32;
        }
    }
}

/// Writes a chunk, as far as `x` goes and then zeros, and returns the sum of its integers.
fn chunk<S: Source>(mut x: &[S::Value], format: XFormat, out: &mut [u32], source: &S) -> i32 {
    let XFormat { shift, starts, .. } = format;
    let mut sum = 0i32;
    let eights = x.len() & !7;
    // The backend writes a start word, too; it is overwritten below.
    let mut done = 0;
    if let Some((last, _)) = starts.split_last()
        && let Some(out) = out.get_mut(starts.len() - 1..)
        && let Some(part) = source.chunks(x, shift, *last, (1, eights), out)
    {
        sum = part;
        done = eights;
    }
    x = x.get(done..).unwrap_or(&[]);
    let Some((start_words, pairs)) = out.split_at_mut_checked(starts.len()) else { return 0 };
    let mut pairs = pairs.get_mut(done / 2..).unwrap_or_default();
    for x in x.chunks(2) {
        let Some((word, rest)) = core::mem::take(&mut pairs).split_first_mut() else { break };
        let (low, high) = (source.integer(x[0]), x.get(1).map_or(0, |v| source.integer(*v)));
        sum = sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
        *word = ((low << shift) & 0xffff) | (high << shift << 16);
        pairs = rest;
    }
    pairs.fill(0);
    for (word, start) in start_words.iter_mut().zip(starts) {
        *word = start.bias.wrapping_add(start.factor.wrapping_mul(sum)) as u32;
    }
    sum
}

/// Words that suffice for a prepared vector of any layout.
pub const fn max_prepared_words(cols: usize, group: usize) -> usize {
    use crate::format::Width;
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

/// What the cost of preparing and of reading a vector depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Columns with the padding.
    pub(crate) columns: usize,
    /// Groups; 1 where the weights have no group scales.
    pub(crate) groups: usize,
    /// Chunks of all groups.
    pub(crate) chunks: usize,
    /// Those of them that are written one by one, because they are short or hold padding.
    pub(crate) single_chunks: usize,
    /// Passes through a kernel's loop that are more than a step of its columns: groups, or runs of a row.
    pub(crate) passes: usize,
}

/// The extent of a vector for blocks of this shape.
pub(crate) const fn extent(shape: BlockShape) -> Extent {
    let plan = Plan::new(shape);
    let groups = plan.padded.div_ceil(plan.group);
    let passes = match (shape.group, plan.format.run) {
        (0, 1) => 0,
        (0, run) => plan.padded.div_ceil(run),
        _ => groups,
    };
    let short = plan.first_chunk != plan.chunk;
    let padded = plan.cols < plan.padded && !(short && plan.chunks == 1);
    let single_chunks = groups * short as usize + padded as usize;
    Extent { columns: plan.padded, groups, chunks: groups * plan.chunks, single_chunks, passes }
}
