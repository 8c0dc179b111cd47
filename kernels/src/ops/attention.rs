//! Attention in integers: `keep` writes keys and values to a cache, and `attend` computes the outputs of queries.
//! `rotary` rotates queries and keys by their positions: of a head, elements `x_i` and `x_j` with `j = i + dim / 2` become
//! `x_i cos_i - x_j sin_i` and `x_j cos_i + x_i sin_i`, rounded after each operation.
//!
//! For each head of a query, with the head of keys and values that it shares (`docs/FORMAT.md` has the cache):
//!
//! 1. The query becomes int8 integers `q` with their own scale, as keys and values did.
//! 2. `score_j = (sum_i q_i * k_ji) * ((factor * q_scale) * k_scale_j)` for each token j that the query sees.
//! 3. `e_j = exp(score_j - max)`, `z = sum_j e_j`, `w_j = e_j * v_scale_j`, `total = sum_j w_j`, in the order of the slots.
//! 4. `p_j = round(w_j * (32767 / total))`, and `y_i = (sum_j p_j * v_ji) * ((total / 32767) / z)`.
//!
//! Sums of products are exact; all else is f32, rounded after each operation. A key, value, query, score or total that is
//! not finite fails the step, so a cache holds only finite numbers.

use core::ops::Range;

use crate::activations::Scale;
use crate::arch::{query_keys, weigh_values};
use crate::arena::{part, regions};
use crate::error::{Fault, PrefixError};
use crate::image::{Cache, Op, OpKind, Region};
use crate::math::{Native, Real, exp};

/// Largest integer of a key, a value or a query.
const MAX: u16 = 127;
/// Sum of a query's weights.
const TOTAL: u16 = 32767;

/// Runs a range of an operation's units: a token's head each.
///
/// # Errors
///
/// [`Fault::NotFinite`] as above, or if a query sees no token. [`Fault::Damaged`] if the image does not have the
/// operation's regions or data.
#[inline(never)]
pub(super) fn run(op: &Op<'_>, arena: &mut [u32], units: &Range<usize>) -> Result<(), Fault> {
    let f = bytemuck::must_cast_slice_mut::<u32, f32>;
    if op.kind == OpKind::Keep {
        let [cache, keys, values, _] = regions(arena, &op.regions, Region::default());
        return keep(op, units, cache, f(keys), f(values));
    }
    if op.kind == OpKind::Rotary {
        return rotate(op, units, f(part(arena, &op.dst().range())));
    }
    let [dst, src, cache, work] = regions(arena, &op.regions, op.work());
    attend(op, units, f(dst), f(src), cache, work)
}

fn keep(op: &Op<'_>, units: &Range<usize>, cache: &mut [u32], keys: &[f32], values: &[f32]) -> Result<(), Fault> {
    let (shape, count) = (op.cache(), *cache.first().ok_or(Fault::Damaged)?);
    // Of the first token: in a ring, or after the tokens of a prefix.
    let first = match (op.is_ring(), shape.own) {
        (true, _) => (count as usize).checked_rem(shape.slots).ok_or(Fault::Damaged)?,
        (false, 0) => 0,
        _ => count as usize,
    };
    for unit in units.clone() {
        let token = unit.checked_div(shape.heads).ok_or(Fault::Damaged)?;
        // A ring keeps one token.
        let slot = first.checked_add(token);
        let (head, slot) = (unit - token * shape.heads, slot.ok_or(Fault::Damaged)?);
        let [key, value] = [vector(keys, unit, shape.dim)?, vector(values, unit, shape.dim)?];
        keep_head(shape, cache, [head, slot], key, value)?;
    }
    if units.end == op.units() && shape.own == 0 {
        // A ring counts on from the slots when it reaches twice as many. A caller may have written any count.
        let (slots, next) = (shape.slots as u32, count.saturating_add(1));
        let next = if op.is_ring() && next < 2 * slots { next } else { slots };
        *cache.first_mut().ok_or(Fault::Damaged)? = next;
    }
    Ok(())
}

/// Writes a head of a token to a slot.
#[inline(always)]
fn keep_head(
    shape: Cache,
    cache: &mut [u32],
    [head, slot]: [usize; 2],
    key: &[f32],
    value: &[f32],
) -> Result<(), Fault> {
    let (scales_and_keys, values_part) = shape.parts(head);
    let [key_scales, value_scales, kept_keys, kept_values] = regions(cache, &scales_and_keys, values_part);
    let key = Integers::of(key, key_scales.get_mut(slot))?;
    let words = slot * shape.key_words()..(slot + 1) * shape.key_words();
    for (i, word) in kept_keys.get_mut(words).ok_or(Fault::Damaged)?.iter_mut().enumerate() {
        *word = key.pair(2 * i) | key.pair(2 * i + 1) << 16;
    }
    let value = Integers::of(value, value_scales.get_mut(slot))?;
    for (i, row) in kept_values.chunks_mut(shape.row_words().max(1)).enumerate() {
        let (word, shift) = (row.get_mut(slot / 2).ok_or(Fault::Damaged)?, 16 * (slot % 2));
        *word = *word & !(0xffff << shift) | value.pair(i) << shift;
    }
    Ok(())
}

impl Cache {
    /// Writes keys and values, each [token, head, column], to the first words of `to`, as the image's own: a cache of a
    /// prefix ([`crate::Head::set_prefix`]). Slots after the last token stay empty.
    ///
    /// # Errors
    ///
    /// [`PrefixError::Length`] if `to` has fewer words than the cache, if keys and values are not equally many, or not whole
    /// tokens; [`PrefixError::Tokens`] without a token, or with more than [`Self::prefix_slots`]; [`PrefixError::NotFinite`] for a value.
    pub fn fill(self, keys: &[f32], values: &[f32], to: &mut [u32]) -> Result<(), PrefixError> {
        let (token, given) = (self.heads.saturating_mul(self.dim), keys.len());
        let tokens = given.checked_div(token).unwrap_or(0);
        let wrong = PrefixError::Length { needed: self.prefix_slots().saturating_mul(token), given };
        let cache = to.get_mut(..self.words()).ok_or(wrong)?;
        if values.len() != given || tokens.saturating_mul(token) != given {
            return Err(wrong);
        }
        if !(1..=self.prefix_slots()).contains(&tokens) {
            return Err(PrefixError::Tokens);
        }
        cache.fill(0);
        let heads = keys.chunks_exact(self.dim.max(1)).zip(values.chunks_exact(self.dim.max(1)));
        for (unit, (key, value)) in heads.enumerate() {
            let place = [unit % self.heads.max(1), unit / self.heads.max(1)];
            keep_head(self, cache, place, key, value).map_err(|_| PrefixError::NotFinite)?;
        }
        cache.iter_mut().take(1).for_each(|count| *count = tokens as u32);
        Ok(())
    }
}

fn rotate(op: &Op<'_>, units: &Range<usize>, x: &mut [f32]) -> Result<(), Fault> {
    let [heads, dim] = op.rotated_heads();
    for unit in units.clone() {
        let token = unit.checked_div(heads).ok_or(Fault::Damaged)?;
        let (cosines, sines) = op.rotation(token).split_at_checked(dim / 2).ok_or(Fault::Damaged)?;
        let head = x.get_mut(unit * dim..(unit + 1) * dim).ok_or(Fault::Damaged)?;
        let (first, second) = head.split_at_mut_checked(dim / 2).ok_or(Fault::Damaged)?;
        for (((x, y), cosine), sine) in first.iter_mut().zip(second).zip(cosines).zip(sines) {
            let of_bits = |bits: &u32| Native::of(f32::from_bits(u32::from_le(*bits)));
            let (a, b, cosine, sine) = (Native::of(*x), Native::of(*y), of_bits(cosine), of_bits(sine));
            (*x, *y) = ((a * cosine - b * sine).get(), (b * cosine + a * sine).get());
        }
    }
    Ok(())
}

fn attend(
    op: &Op<'_>,
    units: &Range<usize>,
    outputs: &mut [f32],
    queries: &[f32],
    cache: &mut [u32],
    work: &mut [u32],
) -> Result<(), Fault> {
    let (shape, heads) = (op.cache(), op.query_heads());
    let kept = (*cache.first().ok_or(Fault::Damaged)? as usize).saturating_add(shape.own).min(shape.slots);
    let last = op.units().checked_div(heads).ok_or(Fault::Damaged)?;
    for unit in units.clone() {
        let token = unit.checked_div(heads).ok_or(Fault::Damaged)?;
        let seen = if op.is_causal() { kept.saturating_sub(last.saturating_sub(1 + token)) } else { kept };
        let shared = (unit - token * heads).checked_div(heads / shape.heads.max(1)).ok_or(Fault::Damaged)?;
        let (scales_and_keys, values_part) = shape.parts(shared);
        let [key_scales, value_scales, keys, values] = regions(cache, &scales_and_keys, values_part);
        let head = Head { key_scales: key_scales.get(..seen).ok_or(Fault::Damaged)?, value_scales, keys, values };
        let y = outputs.get_mut(unit * shape.dim..(unit + 1) * shape.dim).ok_or(Fault::Damaged)?;
        head.attend(shape, op.score_factor(), vector(queries, unit, shape.dim)?, work, y)?;
    }
    Ok(())
}

/// A head of a cache ([`Cache::parts`]).
struct Head<'c> {
    /// Of the tokens that a query sees.
    key_scales: &'c [u32],
    value_scales: &'c [u32],
    keys: &'c [u32],
    values: &'c [u32],
}

impl Head<'_> {
    /// Computes the output `y` of a head of a query `x`.
    #[inline(never)]
    fn attend(&self, shape: Cache, factor: f32, x: &[f32], work: &mut [u32], y: &mut [f32]) -> Result<(), Fault> {
        let (scores, query) = work.split_at_mut_checked(shape.score_words()).ok_or(Fault::Damaged)?;
        let query = query.get_mut(..2 * shape.key_words()).ok_or(Fault::Damaged)?;
        let mut scale = 0;
        let x = Integers::of(x, Some(&mut scale))?;
        for (i, [odd, even]) in query.as_chunks_mut().0.iter_mut().enumerate() {
            [*odd, *even] = x.factors(4 * i);
        }
        let seen = self.key_scales.len();
        let weights = scores.get_mut(..seen).ok_or(Fault::Damaged)?;
        query_keys(self.keys, query, weights);
        scale_scores(factor, f32::from_bits(scale), self.key_scales, weights)?;
        let sum = softmax(self.value_scales, weights);
        let total = Scale::of_magnitude(weights.iter().fold(Native::of(0.0), add).get().to_bits(), TOTAL)?;
        let pairs = to_pairs(total, seen, scores).ok_or(Fault::Damaged)?;
        weigh_values(self.values, shape.row_words(), pairs, bytemuck::must_cast_slice_mut(y));
        let scale = (Native::of(total.get()) / Native::of(sum)).get();
        for y in y {
            *y = scaled(y.to_bits(), scale);
        }
        Ok(())
    }
}

fn add(sum: Native, bits: &u32) -> Native {
    sum + Native::of(f32::from_bits(*bits))
}

/// Returns a sum of products times its scale. All sums are below 2^24, and so exact in f32.
fn scaled(sum: u32, scale: f32) -> f32 {
    (Native::of(sum as i32 as f32) * Native::of(scale)).get()
}

/// Converts sums of products to the bits of scores.
fn scale_scores(factor: f32, query_scale: f32, key_scales: &[u32], scores: &mut [u32]) -> Result<(), Fault> {
    let scale = Native::of(factor) * Native::of(query_scale);
    let mut is_finite = !scores.is_empty();
    for (score, key_scale) in scores.iter_mut().zip(key_scales) {
        let key_scale = Native::of(f32::from_bits(*key_scale));
        let scaled = scaled(*score, (scale * key_scale).get());
        is_finite &= scaled.is_finite();
        *score = scaled.to_bits();
    }
    if is_finite { Ok(()) } else { Err(Fault::NotFinite) }
}

/// Converts finite scores to the tokens' weights, before rounding, and returns the sum of the exponentials.
fn softmax(value_scales: &[u32], scores: &mut [u32]) -> f32 {
    let max = scores.iter().fold(f32::NEG_INFINITY, |max, bits| {
        let score = f32::from_bits(*bits);
        if score > max { score } else { max }
    });
    let sum = scores.iter_mut().zip(value_scales).fold(Native::of(0.0), |sum, (score, value_scale)| {
        let power = exp(Native::of(f32::from_bits(*score)) - Native::of(max));
        *score = (power * Native::of(f32::from_bits(*value_scale))).get().to_bits();
        sum + power
    });
    sum.get()
}

/// Rounds the first `len` weights, and packs them two a word to the start of the same words, of which zeros fill the last
/// four.
fn to_pairs(scale: Scale, len: usize, weights: &mut [u32]) -> Option<&[u32]> {
    let end = 4 * len.div_ceil(8);
    for i in 0..end {
        let of_lane = |lane: usize| match weights.get(2 * i + lane) {
            Some(bits) if 2 * i + lane < len => Native::of(f32::from_bits(*bits)).rounded(scale.inverse()) & 0xffff,
            _ => 0,
        };
        let pair = of_lane(0) | of_lane(1) << 16;
        *weights.get_mut(i)? = pair;
    }
    weights.get(..end)
}

/// A head's vector in integers.
struct Integers<'x> {
    x: &'x [f32],
    inverse: f32,
}

impl<'x> Integers<'x> {
    /// Finds the scale of a vector, and writes its bits to `scale`.
    fn of(x: &'x [f32], scale: Option<&mut u32>) -> Result<Self, Fault> {
        let found = Scale::new(x, MAX)?;
        *scale.ok_or(Fault::Damaged)? = found.get().to_bits();
        Ok(Self { x, inverse: found.inverse() })
    }

    /// Returns the integer of a column; 0 after the last.
    fn column(&self, i: usize) -> i32 {
        self.x.get(i).map_or(0, |x| i32::from(Native::of(*x).rounded(self.inverse) as i16))
    }

    /// Returns columns `2 i` and `2 i + 1` in 16 bits: `even + 256 odd`.
    fn pair(&self, i: usize) -> u32 {
        (self.column(2 * i) + 256 * self.column(2 * i + 1)) as u32 & 0xffff
    }

    /// Returns what four columns of a key from column `i` on are multiplied with: their pairs with the first word, and
    /// the even columns of the pairs with the second.
    fn factors(&self, i: usize) -> [u32; 2] {
        let [a, b, c, d] = [0, 1, 2, 3].map(|next| self.column(i + next));
        let lanes = |low: i32, high: i32| low as u32 & 0xffff | (high as u32) << 16;
        [lanes(b, d), lanes(256 * a - b, 256 * c - d)]
    }
}

/// Returns the vector of a unit.
fn vector(all: &[f32], unit: usize, dim: usize) -> Result<&[f32], Fault> {
    all.get(unit * dim..(unit + 1) * dim).ok_or(Fault::Damaged)
}
