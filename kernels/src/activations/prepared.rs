//! A prepared vector, and its preparation in Rust.

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
    lay_out(x, plan, out.get_mut(..plan.words)?, |value| value as u16 as u32);
    Prepared::new(out, plan)
}

/// Writes the prepared vector of any values, which `integer` converts to integers whose low 16 bits count.
pub(crate) fn lay_out<V: Copy>(x: &[V], plan: &Plan, out: &mut [u32], integer: impl Fn(V) -> u32) {
    let mut x = x;
    for group in out.chunks_exact_mut(plan.group_words().max(1)).take(plan.groups) {
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
            // The groups of a pair are chunks; without pairs, both halves are the group's sum.
            let first = if plan.layout.x.pairs { sum.wrapping_sub(last) } else { sum };
            let second = if plan.layout.x.pairs { last } else { sum };
            let halves = (first & 0xffff) | second << 16;
            *word = if !plan.shape.has_groups() { sum } else { halves } as u32;
        }
    }
}

/// Writes a chunk of `x`, filled with zeros, and returns the sum of its integers.
fn chunk<V: Copy>(x: &[V], format: &XLayout, out: &mut [u32], integer: &impl Fn(V) -> u32) -> i32 {
    let (starts, pairs) = out.split_at_mut(format.start_words.min(out.len()));
    if format.has_bytes() {
        let mut sum = 0i32;
        pairs.fill(0);
        for (i, value) in x.iter().enumerate() {
            let byte = integer(*value) as u8;
            sum = sum.wrapping_add(byte as i8 as i32);
            if let Some(word) = pairs.get_mut(i / 4) {
                *word |= u32::from(byte) << (8 * (i % 4));
            }
        }
        starts.iter_mut().for_each(|word| *word = sum as u32);
        return sum;
    }
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
