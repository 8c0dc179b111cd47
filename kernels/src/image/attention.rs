//! Sizes of a cache of keys and values, where its parts are, and the caches of a prefix. `docs/FORMAT.md` has their content.

use super::header::MAX_SCRATCH;
use super::op::OpKind;
use super::record::Op;
use super::region::Region;
use super::view::Image;

/// Largest dimension of a head: 256 times a sum of products of int8 fits int32, `256 * 127 * 127 * 512 < 2^31`.
pub const MAX_DIM: usize = 512;
/// Most slots of a cache. The weights of its tokens add up to at most 32767 and half of each rounding, so 257 times a sum
/// of their products with int8 fits int32, `257 * 127 * (32767 + 256) < 2^31`.
pub const MAX_SLOTS: usize = 512;

const _: () = assert!(256 * 127 * 127 * MAX_DIM < 1 << 31 && 257 * 127 * (32767 + MAX_SLOTS / 2) < 1 << 31);

/// The sizes of a cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cache {
    /// Heads of keys and values.
    pub heads: usize,
    /// Dimension of a head.
    pub dim: usize,
    /// Tokens that it has room for.
    pub slots: usize,
    /// Of these, tokens of the network itself after those of a prefix, new in each evaluation; 0 for most caches.
    pub own: usize,
}

impl Cache {
    /// Returns the words of all: a count, the scales, keys and values. A product of sizes that are too large is longer
    /// than an arena.
    pub const fn words(self) -> usize {
        let keys = self.slots.saturating_mul(2 + self.key_words());
        let values = self.value_rows().saturating_mul(self.row_words());
        1 + product([self.heads, keys.saturating_add(values), 1])
    }

    /// Returns the most tokens of a prefix: all but the network's own.
    pub const fn prefix_slots(self) -> usize {
        self.slots.saturating_sub(self.own)
    }

    /// Returns the tokens of an evaluation that the network writes to a cache which is no ring.
    pub(crate) const fn kept(self) -> usize {
        if self.own > 0 { self.own } else { self.slots }
    }

    /// Returns the words of the scales, which follow the count.
    pub(crate) const fn scales(self) -> usize {
        self.slots.saturating_mul(self.heads).saturating_mul(2)
    }

    /// Returns the words of the work area that a head of a query needs: its scores and its integers.
    pub const fn work_words(self) -> usize {
        self.score_words() + 2 * self.key_words()
    }

    /// Returns the words of the scores.
    pub const fn score_words(self) -> usize {
        8 * self.slots.div_ceil(8)
    }

    /// Returns the words of a key, of four columns each: kernels take two at a time.
    pub const fn key_words(self) -> usize {
        2 * self.dim.div_ceil(8)
    }

    /// Returns the rows of a head's values, of two columns each: kernels take two at a time.
    pub const fn value_rows(self) -> usize {
        2 * self.dim.div_ceil(4)
    }

    /// Returns the words of a row of the values, of two tokens each: kernels take four at a time.
    pub const fn row_words(self) -> usize {
        self.score_words() / 2
    }

    /// Returns the parts of a head, as regions of the cache: the scales of its keys and of its values, keys and values.
    /// Their offsets wrap for a head that the cache does not have.
    pub(crate) fn parts(self, head: usize) -> ([Region; 3], Region) {
        let values = self.value_rows() * self.row_words();
        let mut before = 1usize;
        let [key_scales, value_scales, keys, values] = [self.slots, self.slots, self.slots * self.key_words(), values]
            .map(|len| {
                let offset = before.wrapping_add(head.wrapping_mul(len));
                before = before.wrapping_add(self.heads.wrapping_mul(len));
                Region { offset, len }
            });
        ([key_scales, value_scales, keys], values)
    }
}

/// Returns the product of sizes, or a number of words that no arena has.
pub(super) const fn product(sizes: [usize; 3]) -> usize {
    let [a, b, c] = sizes;
    let product = a.saturating_mul(b).saturating_mul(c);
    if product > MAX_SCRATCH { MAX_SCRATCH + 1 } else { product }
}

impl Image<'_> {
    /// Returns the arena region of the prefix: keys and values that come from the head's caller
    /// ([`crate::Head::set_prefix`]). It is between the state and the observation; empty if the image needs none.
    pub(crate) fn prefix(&self) -> Region {
        let offset = self.state().end();
        Region { offset, len: self.observation().offset.saturating_sub(offset) }
    }

    /// Returns the bytes of the prefix that [`crate::Head::set_prefix`] takes; 0 if the image needs none.
    pub fn prefix_bytes(&self) -> usize {
        4 * self.prefix().len
    }

    /// Returns the caches of the prefix, in their order: one for each attention that reads it.
    pub fn prefix_caches(&self) -> impl Iterator<Item = Cache> {
        let prefix = self.prefix();
        let mut at = prefix.offset;
        (0..self.op_count()).filter_map(move |i| {
            let op = self.op(i).ok().filter(|op| op.reads_prefix(prefix) && op.third().offset == at)?;
            at = op.third().end();
            Some(op.cache())
        })
    }
}

impl Op<'_> {
    /// Returns `true` if the operation is an attention to a cache that begins in the prefix.
    pub(super) fn reads_prefix(&self, prefix: Region) -> bool {
        self.kind == OpKind::Attend && prefix.range().contains(&self.third().offset)
    }

    /// Returns the cache of an operation of attention.
    pub fn cache(&self) -> Cache {
        let first = usize::from(self.kind == OpKind::Attend);
        let [heads, dim, slots, flags] = [0, 1, 2, 3].map(|i| self.half(first + i));
        Cache { heads, dim, slots, own: flags >> 1 }
    }

    /// Returns the heads of [`OpKind::Rotary`] and the dimension of a head.
    pub fn rotated_heads(&self) -> [usize; 2] {
        [self.half(0), self.half(1)]
    }

    /// Returns the cosines, then the sines of [`OpKind::Rotary`]'s angles for a token; empty if the image does not have
    /// them.
    pub(crate) fn rotation(&self, token: usize) -> &'_ [u32] {
        let [_, dim] = self.rotated_heads();
        self.floats_at(1usize.wrapping_add(token.wrapping_mul(dim)), dim)
    }

    /// Returns the heads of [`OpKind::Attend`]'s queries.
    pub fn query_heads(&self) -> usize {
        self.half(0)
    }

    /// Returns the factor of [`OpKind::Attend`]'s scores.
    pub fn score_factor(&self) -> f32 {
        self.constant(3)
    }

    /// Returns `true` if [`OpKind::Keep`] keeps one token in a step, after those of earlier steps.
    pub fn is_ring(&self) -> bool {
        self.half(3) & 1 != 0
    }

    /// Returns `true` if a query of [`OpKind::Attend`] does not see the tokens after its own.
    pub fn is_causal(&self) -> bool {
        self.half(4) & 1 != 0
    }

    /// Returns an operation of attention with the lengths of `src` and of the third region; any other as it is.
    pub(super) fn with_lengths(mut self) -> Self {
        if !matches!(self.kind, OpKind::Keep | OpKind::Attend) {
            return self;
        }
        let (cache, is_ring) = (self.cache(), self.is_ring());
        let [dst, src, third] = &mut self.regions;
        match self.kind {
            OpKind::Attend => [src.len, third.len] = [dst.len, cache.words()],
            OpKind::Keep => {
                let tokens = if is_ring { 1 } else { cache.kept() };
                [src.len, third.len] = [product([tokens, cache.heads, cache.dim]); 2];
            }
            _ => {}
        }
        self
    }
}
