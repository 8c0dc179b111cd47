//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! The **one rounding rule** of the project is round half to even, and it is computed by adding `1.5 * 2^23`: for `|v| < 2^22`
//! the sum's low mantissa bits are the rounded value in two's complement. It is one FPU addition, and the same bits everywhere.
//!
//! A prepared vector is made for the layout that reads it ([`XFormat`]): for each group of columns (the whole row where the
//! weights have no group scales) its chunks, and behind them, where the layout asks for it, the sum of the group's values. A
//! chunk is its start words and its int16 pairs, column `2j` in the low half. The last one is padded with zeros up to where the
//! weights are, or to a multiple of [`PAD_COLS`] with single lanes.

use crate::format::{BlockShape, Lanes, PAD_COLS, XFormat, div_up, round_up};

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;

/// Vectors whose largest magnitude is below this (2^-100) count as zero, so that the reciprocal of the scale stays finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// How a prepared vector is laid out: the layout's needs, with the lengths of the vector.
#[derive(Clone, Copy, Debug)]
struct Plan {
    format: &'static XFormat,
    cols: usize,
    /// Columns with the padding.
    padded: usize,
    /// Columns of a group; all of them where there are no groups.
    group: usize,
    /// Groups; the last one may be short.
    groups: usize,
    /// Columns of a chunk.
    chunk: usize,
    /// Columns of a group's first chunk, which is short where they do not fill all.
    first_chunk: usize,
    /// Chunks of a group.
    chunks: usize,
}

impl Plan {
    /// Every call of a kernel comes through here; all lengths but the vector's are powers of two, so nothing is divided.
    #[inline(never)]
    const fn new(shape: BlockShape) -> Self {
        let format = &shape.layout().x;
        let padded = match shape.lanes {
            Lanes::Single => round_up(shape.cols, PAD_COLS),
            Lanes::Paired => round_up(shape.cols, shape.step()),
        };
        let (group, groups) = match shape.group {
            group @ 1.. if group < padded => (group, div_up(padded, group)),
            _ => (padded, 1),
        };
        if format.chunk >= group {
            return Self {
                format,
                cols: shape.cols,
                padded,
                group,
                groups,
                chunk: group,
                first_chunk: group,
                chunks: 1,
            };
        }
        let chunk = format.chunk;
        let chunks = div_up(group, chunk);
        let first_chunk = group - (chunks - 1) * chunk;
        Self { format, cols: shape.cols, padded, group, groups, chunk, first_chunk, chunks }
    }

    /// The plan where the columns are valid. What is prepared for another invalid shape fits no block.
    #[inline(always)]
    fn checked(shape: BlockShape) -> Option<Self> {
        (1..=0xffff).contains(&shape.cols).then(|| Self::new(shape))
    }

    /// Chunks in the first columns of a group; `last`: with one that they do not fill.
    const fn chunks_in(&self, columns: usize, last: bool) -> usize {
        if columns < self.first_chunk {
            return last as usize;
        }
        let behind = columns - self.first_chunk;
        1 + if last { behind.div_ceil(self.chunk) } else { behind / self.chunk }
    }

    const fn chunk_words(&self) -> usize {
        self.format.starts.len() + self.chunk / 2
    }

    const fn group_words(&self) -> usize {
        self.group / 2 + self.extra_words()
    }

    /// Words of a group that hold no pairs. A short group has but one chunk, like all groups of single lanes.
    const fn extra_words(&self) -> usize {
        self.chunks * self.format.starts.len() + self.format.sum as usize
    }

    /// Words before the pair of column `col`.
    const fn words_before(&self, col: usize) -> usize {
        let (group, col) = (col / self.group, col % self.group);
        let full_before = (col + self.chunk - self.first_chunk) / self.chunk;
        group * self.group_words() + (full_before + 1) * self.format.starts.len() + col / 2
    }

    const fn words(&self) -> usize {
        self.padded / 2 + self.groups * self.extra_words()
    }

    /// See [`Prepared::bounds`]. Single lanes read no more than the block's own units; with row scales, the vector's sum
    /// stands behind the end.
    #[cfg(actq_armv7em)]
    const fn bounds(&self, shape: BlockShape) -> (usize, usize) {
        let unread = match shape.lanes {
            Lanes::Single => (self.padded - round_up(shape.cols, shape.step())) / 2,
            Lanes::Paired => 0,
        };
        let sum_behind = (self.format.sum && shape.group == 0) as usize;
        let extra = match self.format.starts {
            [start] if self.format.sum => 0usize.wrapping_sub(self.chunks * start.bias as usize),
            // Single lanes with row scales: there are no groups to count.
            _ if shape.group == 0 && matches!(shape.lanes, Lanes::Single) => 0,
            starts => 4 * (starts.len() + self.first_chunk / 2),
        };
        (self.words() - unread - sum_behind, extra)
    }

    /// Steps that the first pass through the loop of a kernel for row scales leaves out. Passes and steps are powers of two, and
    /// chunks that are longer than a pass are whole passes.
    #[cfg(actq_armv7em)]
    const fn skip(&self, shape: BlockShape) -> usize {
        let step = shape.layout().step;
        (0usize.wrapping_sub(round_up(shape.cols, step)) & (self.format.run - 1)) >> step.trailing_zeros()
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
    /// The shape; its rows do not matter.
    shape: BlockShape,
    #[cfg(actq_armv7em)]
    bounds: (usize, usize),
    #[cfg(actq_armv7em)]
    skip: usize,
}

impl<'a> Prepared<'a> {
    /// Names a vector that [`Scale::quantize`] or [`prepare`] wrote for blocks of this shape (their rows do not matter); `None`
    /// where the length differs from [`prepared_words`] or there are no columns or too many.
    pub fn new(words: &'a [u32], shape: BlockShape) -> Option<Self> {
        let plan = Plan::checked(shape)?;
        (words.len() == plan.words()).then(|| Self::planned(words, shape, &plan))
    }

    #[inline(always)]
    fn planned(words: &'a [u32], shape: BlockShape, _plan: &Plan) -> Self {
        Self {
            words,
            shape,
            #[cfg(actq_armv7em)]
            bounds: _plan.bounds(shape),
            #[cfg(actq_armv7em)]
            skip: _plan.skip(shape),
        }
    }

    /// Whether the vector was prepared for blocks of this shape.
    pub fn fits(&self, shape: BlockShape) -> bool {
        let BlockShape { width, lanes, rows: _, cols, group } = self.shape;
        (width, lanes, cols, group) == (shape.width, shape.lanes, shape.cols, shape.group)
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

    /// What the assembler is told about the vector: the words up to where it stops reading, and either the bytes of the first
    /// chunk (0 for single lanes with row scales), or, where chunks are summed without being taken apart, minus the biases of
    /// all chunks.
    #[cfg(actq_armv7em)]
    pub(crate) fn bounds(&self) -> (usize, usize) {
        self.bounds
    }

    /// The layout's steps that the first pass through a kernel's loop leaves out.
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

    /// Writes the integers of `x`, prepared for blocks of `shape`, to the first [`prepared_words`] words of `out`, and names
    /// them. Missing values of `x` count as zeros. `None`, with nothing written, where `out` is too short, or there are no columns
    /// or too many.
    #[inline(never)]
    pub fn quantize<'w>(self, x: &[f32], shape: BlockShape, out: &'w mut [u32]) -> Option<Prepared<'w>> {
        fill(x, shape, out, &Quantizer { inverse: self.inverse })
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
pub fn prepare<'w>(x: &[i16], shape: BlockShape, out: &'w mut [u32]) -> Option<Prepared<'w>> {
    fill(x, shape, out, &Copier)
}

/// A run of whole groups, each of `first` columns and then chunks of `chunk` columns.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(actq_fpu), expect(dead_code, reason = "only the FPU's backend has code for whole groups"))]
pub(crate) struct Groups {
    pub(crate) groups: usize,
    /// Chunks of a group.
    pub(crate) chunks: usize,
    /// Columns of a group's first chunk.
    pub(crate) first: usize,
    /// Columns of the other chunks.
    pub(crate) chunk: usize,
}

/// What turns values into the integers of a prepared vector.
trait Source {
    type Value: Copy;

    /// An integer whose low 16 bits count.
    fn integer(&self, value: Self::Value) -> u32;

    /// Writes groups with all that belongs to them, and returns the sum of the last group's integers where the layout asks
    /// for sums; `None`, with nothing written, where the backend has no code for these lengths.
    fn groups(&self, _x: &[Self::Value], _format: &XFormat, _groups: Groups, _out: &mut [u32]) -> Option<i32> {
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
    fn groups(&self, x: &[f32], format: &XFormat, groups: Groups, out: &mut [u32]) -> Option<i32> {
        crate::armv7em::quantize(x, self.inverse, format, groups, out)
    }
}

/// Lays a vector out.
#[inline(always)]
fn fill<'w, S: Source>(x: &[S::Value], shape: BlockShape, out: &'w mut [u32], source: &S) -> Option<Prepared<'w>> {
    let plan = Plan::checked(shape)?;
    let out = out.get_mut(..plan.words())?;
    let x = x.get(..plan.cols).unwrap_or(x);
    // All whole groups at once; a vector without groups is one.
    let groups = match plan.groups {
        1 => usize::from(x.len() == plan.padded),
        _ => x.len() >> plan.group.trailing_zeros(),
    };
    let Plan { chunks, first_chunk: first, chunk, .. } = plan;
    let done = match source.groups(x, plan.format, Groups { groups, chunks, first, chunk }, out) {
        Some(_) => groups,
        None => 0,
    };
    if done < plan.groups {
        rest(x, shape, done, out, source);
    }
    Some(Prepared::planned(out, shape, &plan))
}

/// Writes the groups from `done` on. Seldom needed, so it makes its own plan.
#[inline(never)]
fn rest<S: Source>(x: &[S::Value], shape: BlockShape, done: usize, out: &mut [u32], source: &S) {
    let plan = &Plan::new(shape);
    let mut groups = x.chunks(plan.group.max(1)).skip(done);
    for out in out.chunks_mut(plan.group_words().max(1)).skip(done) {
        group(groups.next().unwrap_or(&[]), plan, out, source);
    }
}

/// Writes a group that is not whole, or all of it where the backend has no code.
fn group<S: Source>(x: &[S::Value], plan: &Plan, out: &mut [u32], source: &S) {
    let sum_at = out.len().saturating_sub(usize::from(plan.format.sum));
    let Some((mut out, sum_word)) = out.split_at_mut_checked(sum_at) else { return };
    let mut sum = 0i32;
    let mut columns = plan.first_chunk;
    let mut x = x;
    // Whole chunks at once, unless the first is short and x does not fill it.
    let whole = if x.len() < plan.first_chunk { 0 } else { 1 + (x.len() - plan.first_chunk) / plan.chunk.max(1) };
    let run = Groups { groups: 1, chunks: whole, first: plan.first_chunk, chunk: plan.chunk };
    if let Some(part) = source.groups(x, plan.format, run, out) {
        sum = part;
        let done = plan.first_chunk + (whole - 1) * plan.chunk;
        x = x.get(done..).unwrap_or(&[]);
        out = out.get_mut(whole * plan.format.starts.len() + done / 2..).unwrap_or_default();
        columns = plan.chunk;
    }
    while !out.is_empty() {
        let words = plan.format.starts.len() + columns / 2;
        let (this, rest) = out.split_at_mut(words.min(out.len()));
        let (this_x, rest_x) = x.split_at(columns.min(x.len()));
        sum = sum.wrapping_add(chunk(this_x, plan.format, this, source));
        (x, out, columns) = (rest_x, rest, plan.chunk);
    }
    if let Some(word) = sum_word.first_mut() {
        *word = sum as u32;
    }
}

/// Writes a chunk, as far as `x` goes and then zeros, and returns the sum of its integers where the layout asks for sums.
fn chunk<S: Source>(x: &[S::Value], format: &XFormat, out: &mut [u32], source: &S) -> i32 {
    let XFormat { shift, starts, .. } = *format;
    // The backend takes eights. What it writes behind them, as for a whole group, is overwritten below.
    let eights = x.len() & !7;
    let run = Groups { groups: 1, chunks: 1, first: eights, chunk: eights };
    let (sum, done) = source.groups(x, format, run, out).map_or((0, 0), |sum| (sum, eights));
    let Some((start_words, pairs)) = out.split_at_mut_checked(starts.len()) else { return sum };
    if done == 0 {
        start_words.iter_mut().zip(starts).for_each(|(word, start)| *word = start.bias as u32);
    }
    let mut pairs = pairs.get_mut(done / 2..).unwrap_or_default();
    let mut rest_sum = 0i32;
    for x in x.get(done..).unwrap_or(&[]).chunks(2) {
        let Some((word, rest)) = core::mem::take(&mut pairs).split_first_mut() else { break };
        let (low, high) = (source.integer(x[0]), x.get(1).map_or(0, |v| source.integer(*v)));
        rest_sum = rest_sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
        *word = ((low << shift) & 0xffff) | (high << shift << 16);
        pairs = rest;
    }
    pairs.fill(0);
    for (word, start) in start_words.iter_mut().zip(starts) {
        *word = word.wrapping_add(start.factor.wrapping_mul(rest_sum) as u32);
    }
    sum.wrapping_add(rest_sum)
}

/// Words that suffice for a prepared vector of any layout: the most that [`prepared_words`] gives. Layouts with chunks of eight
/// columns and a sum take the most, and those that pad a row to [`PAD_COLS`].
pub const fn max_prepared_words(cols: usize, group: usize) -> usize {
    if group == 0 {
        let (padded, chunked) = (div_up(cols, PAD_COLS) * (PAD_COLS / 2), div_up(cols, 8) * 5);
        return 1 + if padded > chunked { padded } else { chunked };
    }
    div_up(cols, group) * (group / 8 * 5 + 1)
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
    /// Those of them that are written one by one, because the columns do not fill them or, with them, the group's first.
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
    let before = (groups - 1) * plan.group;
    let full = plan.chunks_in(plan.cols - before, false);
    let single_chunks = if plan.cols == plan.padded { 0 } else { plan.chunks_in(plan.padded - before, true) - full };
    Extent { columns: plan.padded, groups, chunks: groups * plan.chunks, single_chunks, passes }
}
