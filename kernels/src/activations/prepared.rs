//! A prepared vector, and its preparation in Rust.

use core::cell::Cell;

use super::plan::Plan;
use crate::layout::XLayout;

/// A prepared vector.
#[derive(Clone, Copy, Debug)]
pub struct Prepared<'a> {
    words: &'a [u32],
    plan: &'a Plan,
}

impl<'a> Prepared<'a> {
    /// Wraps a vector that [`Scale::quantize`](super::Scale::quantize) wrote with this plan to the start of `words`;
    /// `None` if they are fewer than the plan's words.
    #[inline(always)]
    pub fn new(words: &'a [u32], plan: &'a Plan) -> Option<Self> {
        Some(Self { words: words.get(..plan.words)?, plan })
    }

    /// Returns the plan of the vector.
    #[inline(always)]
    pub fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// Returns all words.
    #[inline(always)]
    pub fn words(&self) -> &'a [u32] {
        self.words
    }

    /// Iterates over the groups' words, each with its sum if the layout has one.
    pub(crate) fn groups(&self) -> impl Iterator<Item = &'a [u32]> {
        self.words.chunks(self.plan.group_words().max(1))
    }

    /// Iterates over the chunks of a group's words, without its sum.
    pub(crate) fn chunks(&self, group: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
        let (first, rest) = group.split_at(self.plan.chunk_words(self.plan.first).min(group.len()));
        core::iter::once(first).chain(rest.chunks(self.plan.chunk_words(self.plan.layout.x.chunk).max(1)))
    }

    /// Returns the value of column `col`; 0 when out of range.
    pub fn value(&self, col: usize) -> i16 {
        if col >= self.plan.padded {
            return 0;
        }
        let word = self.words.get(self.plan.words_before(col)).copied().unwrap_or(0);
        if self.plan.layout.x.has_bytes() {
            return (word >> (8 * (col % 4))) as i8 as i16;
        }
        ((word >> (16 * (col % 2))) as i16) >> self.plan.layout.x.shift
    }
}

/// Prepares integers as [`Scale::quantize`](super::Scale::quantize) prepares f32 values.
pub fn prepare<'w>(x: &[i16], plan: &'w Plan, out: &'w mut [u32]) -> Option<Prepared<'w>> {
    let x = x.get(..plan.shape.cols).unwrap_or(x);
    lay_out(x, plan, cells(out.get_mut(..plan.words)?), |value| *value as u16 as u32, |value| value);
    Prepared::new(out, plan)
}

/// Returns the words as cells, which two slices can share.
pub(crate) fn cells(words: &mut [u32]) -> &[Cell<u32>] {
    Cell::from_mut(words).as_slice_of_cells()
}

/// Writes the prepared vector of any values: `read` reads one, and `integer` makes it an integer whose low 16 bits count, of 0
/// itself. The values may be the words of `out` from its start on: no word is written before the values up to it are
/// read.
pub(crate) fn lay_out<V>(
    x: &[V],
    plan: &Plan,
    out: &[Cell<u32>],
    read: impl Fn(&V) -> u32,
    integer: impl Fn(u32) -> u32,
) {
    let mut x = x;
    for group in out.chunks_exact(plan.group_words().max(1)).take(plan.groups) {
        let (mut chunks, sum_word) = group.split_at(group.len() - usize::from(plan.layout.x.sum));
        let (mut sum, mut last) = (0i32, 0);
        let mut columns = plan.first;
        while !chunks.is_empty() {
            let (this, rest) = chunks.split_at(plan.chunk_words(columns).min(chunks.len()));
            let (this_x, rest_x) = x.split_at(columns.min(x.len()));
            last = chunk(this_x, &plan.layout.x, this, &read, &integer);
            sum = sum.wrapping_add(last);
            (x, chunks, columns) = (rest_x, rest, plan.layout.x.chunk);
        }
        if let Some(word) = sum_word.first() {
            // The groups of a pair are chunks; without pairs, both halves are the group's sum.
            let first = if plan.layout.x.pairs { sum.wrapping_sub(last) } else { sum };
            let second = if plan.layout.x.pairs { last } else { sum };
            let halves = (first & 0xffff) | second << 16;
            word.set(if !plan.shape.has_groups() { sum } else { halves } as u32);
        }
    }
}

/// Writes a chunk of `x`, filled with zeros, and returns the sum of its integers.
fn chunk<V>(
    x: &[V],
    format: &XLayout,
    out: &[Cell<u32>],
    read: &impl Fn(&V) -> u32,
    integer: &impl Fn(u32) -> u32,
) -> i32 {
    let (starts, pairs) = out.split_at(format.start_words.min(out.len()));
    let mut sum = 0i32;
    if format.has_bytes() {
        let mut words = pairs.iter();
        for four in x.chunks(4) {
            let mut bytes = [0; 4];
            for (byte, value) in bytes.iter_mut().zip(four) {
                *byte = integer(read(value)) as u8;
                sum = sum.wrapping_add(*byte as i8 as i32);
            }
            if let Some(word) = words.next() {
                word.set(u32::from_le_bytes(bytes));
            }
        }
        words.for_each(|word| word.set(0));
        starts.iter().for_each(|word| word.set(sum as u32));
        return sum;
    }
    let (whole, rest) = x.as_chunks::<2>();
    let (mut whole, odd) = (whole.iter(), rest.first().map_or(0, read));
    let filled = x.len().div_ceil(2).min(pairs.len());
    let shift = format.shift;
    // Two start words move the first pair to where the second is read: it is written last.
    let first = Cell::new(0);
    let (mut to, mut words) = (&first, pairs.iter().skip(1));
    for _ in 0..filled {
        let pair = whole.next().map_or([odd, 0], |[low, high]| [read(low), read(high)]);
        let [low, high] = pair.map(integer);
        sum = sum.wrapping_add(low as i16 as i32).wrapping_add(high as i16 as i32);
        to.set(((low << shift) & 0xffff) | (high << shift << 16));
        to = words.next().unwrap_or(to);
    }
    if let Some(word) = pairs.first() {
        word.set(first.get());
    }
    pairs.iter().skip(filled).for_each(|word| word.set(0));
    for (word, start) in starts.iter().zip(format.starts) {
        word.set(start.bias.wrapping_add(start.factor.wrapping_mul(sum)) as u32);
    }
    sum
}
