//! Images of one attention, without a matrix: queries, keys and values are the observation, the outputs are the action.
#![allow(dead_code, reason = "each test uses some of it")]
#![expect(clippy::expect_used, reason = "a test")]

use actq_kernels::image::{Cache, Header, Kind, OpKind, OpRecord, Records, Region, header as h, seal};
use actq_kernels::{Head, Image};
use actq_testkit::Random;

/// An attention of a step's queries, keys and values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attention {
    /// Heads of the queries, a multiple of the cache's.
    pub(crate) heads: usize,
    pub(crate) cache: Cache,
    /// Tokens of the queries.
    pub(crate) tokens: usize,
    /// One token of keys and values a step; else all slots in each.
    pub(crate) is_ring: bool,
    pub(crate) is_causal: bool,
    /// `true` for queries with rotary positions; the dimension is then even.
    pub(crate) is_rotated: bool,
    pub(crate) factor: f32,
}

/// Attention to a prefix: the observation is the queries, and then the own keys and values of each cache that has any.
#[derive(Clone, Debug)]
pub(crate) struct Prefixed {
    /// Heads of the queries, a multiple of each cache's.
    pub(crate) heads: usize,
    /// The caches of the prefix, all of one dimension. The queries of each but the first are the outputs before it.
    pub(crate) caches: Vec<Cache>,
    /// Tokens of the queries.
    pub(crate) tokens: usize,
    /// Only if each cache has as many own tokens.
    pub(crate) is_causal: bool,
    pub(crate) factor: f32,
}

impl Prefixed {
    /// Draws a small one.
    pub(crate) fn draw(random: &mut Random) -> Self {
        let (dim, groups) = (1 + random.below(20), 1 + random.below(3));
        let caches = 1 + random.below(3);
        let mut cache = || {
            let slots = 1 + random.below(24);
            Cache { heads: groups, dim, slots, own: random.below(2) * random.below(slots) }
        };
        let caches: Vec<_> = (0..caches).map(|_| cache()).collect();
        let (factor, tokens) = (1.0 / (dim as f32).sqrt(), 1 + random.below(4));
        let is_causal = caches.iter().all(|cache| cache.own >= tokens);
        Self { heads: groups * (1 + random.below(3)), caches, tokens, is_causal, factor }
    }

    /// Returns the values of the queries and of an action.
    pub(crate) fn len(&self) -> usize {
        self.tokens * self.heads * self.caches[0].dim
    }

    /// Returns the values of an observation.
    pub(crate) fn obs_len(&self) -> usize {
        self.len() + self.caches.iter().map(|cache| 2 * own_len(cache)).sum::<usize>()
    }

    /// Draws keys and values of each cache, of up to all its slots.
    pub(crate) fn keys_and_values(&self, random: &mut Random) -> Vec<[Vec<f32>; 2]> {
        let of = |cache: &Cache| {
            let len = (1 + random.below(cache.prefix_slots())) * cache.heads * cache.dim;
            [0; 2].map(|_| (0..len).map(|_| random.unit()).collect())
        };
        self.caches.iter().map(of).collect()
    }

    /// Returns the bytes of a prefix.
    pub(crate) fn bytes(&self, keys_and_values: &[[Vec<f32>; 2]]) -> Vec<u8> {
        let mut words = Vec::new();
        for (cache, [keys, values]) in self.caches.iter().zip(keys_and_values) {
            let mut of_cache = vec![0; cache.words()];
            cache.fill(keys, values, &mut of_cache).expect("they fit");
            words.extend(of_cache);
        }
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// Returns the image.
    pub(crate) fn image(&self) -> Vec<u32> {
        let pair = |low: usize, high: usize| (low | high << 16) as u32;
        let (len, prefix) = (self.len(), self.caches.iter().map(|cache| cache.words()).sum::<usize>());
        let mut words = vec![0; h::WORDS];
        let mut records = Vec::new();
        let (mut at, mut queries, mut own) = (0, prefix, prefix + len);
        let mut dst = Region { offset: prefix + self.obs_len(), len };
        for cache in &self.caches {
            let (Cache { heads, dim, slots, own: tokens }, len) = (*cache, own_len(cache));
            let region = Region { offset: at, len: cache.words() };
            if tokens > 0 {
                let data = words.len() as u32;
                words.extend([pair(heads, dim), pair(slots, tokens << 1)]);
                records.push(OpRecord { kind: OpKind::Keep, dst: region, src: own, third: own + len, bias: 0, data });
                own += 2 * len;
            }
            let data = words.len() as u32;
            let flags = usize::from(self.is_causal) | tokens << 1;
            words.extend([pair(self.heads, heads), pair(dim, slots), flags as u32, self.factor.to_bits()]);
            records.push(OpRecord { kind: OpKind::Attend, dst, src: queries, third: at, bias: 0, data });
            at += region.len;
            queries = dst.offset;
            dst.offset += dst.len;
        }
        let ops = Records { offset: words.len() as u32, count: records.len() };
        for record in records {
            words.extend(record.emit().expect("small sizes"));
        }
        // Limits, without which no controller arms.
        let contract = words.len() as u32;
        words.extend([-1000f32, 1000.0].into_iter().flat_map(|limit| vec![limit.to_bits(); len]));
        let action = queries + len;
        let work_words = self.caches.iter().map(|cache| cache.work_words()).max().expect("a cache");
        let header = Header {
            obs_len: self.obs_len(),
            act_len: len,
            scratch: action + len + work_words,
            observation: prefix,
            output: queries,
            action,
            work: Region { offset: action + len, len: work_words },
            ops,
            contract,
            contract_flags: 0b1100,
            ..header(words.len(), 1)
        };
        finish(words, header, |head| head.set_test_prefix())
    }
}

/// Returns the keys of a cache's own tokens.
pub(crate) fn own_len(cache: &Cache) -> usize {
    cache.own * cache.heads * cache.dim
}

/// Returns the header of an image whose name begins at this word, with a self-test of `steps` after it. All else is empty.
fn header(name: usize, steps: usize) -> Header {
    let end = name as u32;
    Header {
        kind: Kind::Step,
        has_ports: false,
        obs_len: 0,
        act_len: 0,
        chunk: 1,
        execute: 1,
        horizon: 0,
        overlap: 0,
        deadline: 0,
        rate_hz: 50.0,
        scratch: 0,
        state: Region::default(),
        observation: 0,
        output: 0,
        action: 0,
        work: Region::default(),
        matrices: Records { offset: h::WORDS as u32, count: 0 },
        ops: Records { offset: 0, count: 0 },
        first_denoising_op: 0,
        denoising_steps: 0,
        contract: end,
        contract_flags: 0,
        name: Records { offset: end, count: 4 },
        self_test: Records { offset: end + 1, count: steps },
        weights: 0,
        digest: [0; 32],
    }
}

/// Appends name and self-test to the words of an image, and writes its header. `prepare` prepares a head for a step.
fn finish(mut words: Vec<u32>, header: Header, prepare: impl Fn(&mut Head<'_, '_>)) -> Vec<u32> {
    let (steps, each) = (header.self_test.count, header.obs_len + header.act_len);
    words.push(u32::from_le_bytes(*b"heed"));
    let first = words.len();
    words.extend(vec![0; steps * each]);
    words[..h::WORDS].copy_from_slice(&header.emit().expect("small sizes"));
    words.iter_mut().for_each(|word| *word = word.to_le());
    let mut random = Random::new(5);
    let observations: Vec<Vec<f32>> =
        (0..steps).map(|_| (0..header.obs_len).map(|_| random.unit()).collect()).collect();
    seal(bytemuck::cast_slice_mut(&mut words)).expect("the length fits");
    let step = |head: &mut Head<'_, '_>, x: &[f32]| head.step(x).expect("all is finite").to_vec();
    let actions: Vec<_> = on_head(&words, |head| {
        prepare(head);
        observations.iter().map(|x| step(head, x)).collect()
    });
    let values = observations.iter().zip(&actions).flat_map(|(observation, action)| observation.iter().chain(action));
    for (word, x) in words[first..].iter_mut().zip(values) {
        *word = x.to_bits().to_le();
    }
    seal(bytemuck::cast_slice_mut(&mut words)).expect("the length fits");
    words
}

impl Attention {
    /// Draws a small attention.
    pub(crate) fn draw(random: &mut Random) -> Self {
        let (groups, sharing) = (1 + random.below(4), 1 + random.below(4));
        let cache = Cache { heads: groups, dim: 1 + random.below(20), slots: 1 + random.below(24), own: 0 };
        let is_ring = random.below(2) == 0;
        let tokens = if is_ring { 1 } else { 1 + random.below(cache.slots) };
        let factor = 1.0 / (cache.dim as f32).sqrt();
        let is_rotated = cache.dim.is_multiple_of(2);
        Self { heads: groups * sharing, cache, tokens, is_ring, is_causal: random.below(2) == 0, is_rotated, factor }
    }

    /// Returns the cosines of a token's angles, then the sines.
    fn angles(&self, token: usize) -> Vec<f32> {
        let angles = (0..self.cache.dim / 2).map(|i| 0.3 + 0.7 * token as f64 + 0.11 * i as f64);
        angles.clone().map(|angle| angle.cos() as f32).chain(angles.map(|angle| angle.sin() as f32)).collect()
    }

    /// Returns the queries of an observation, with their positions.
    pub(crate) fn queries(&self, observation: &[f32]) -> Vec<f32> {
        let (dim, half) = (self.cache.dim, self.cache.dim / 2);
        let mut queries = observation[..self.lengths()[0]].to_vec();
        for (at, head) in queries.chunks_exact_mut(dim).enumerate().filter(|_| self.is_rotated) {
            let angles = self.angles(at / self.heads);
            for i in 0..half {
                let (x, y, cos, sin) = (head[i], head[half + i], angles[i], angles[half + i]);
                (head[i], head[half + i]) = (x * cos - y * sin, y * cos + x * sin);
            }
        }
        queries
    }

    /// Returns the lengths of queries, keys and values.
    pub(crate) fn lengths(&self) -> [usize; 3] {
        let kept = if self.is_ring { 1 } else { self.cache.slots } * self.cache.heads * self.cache.dim;
        [self.tokens * self.heads * self.cache.dim, kept, kept]
    }

    /// Returns the steps of the image's self-test: a ring wraps around.
    fn steps(&self) -> usize {
        if self.is_ring { self.cache.slots.min(20) + 2 } else { 1 }
    }

    /// Returns the image.
    pub(crate) fn image(&self) -> Vec<u32> {
        let [queries, keys, values] = self.lengths();
        let cache = self.cache.words();
        let state = if self.is_ring { cache } else { 0 };
        let observed = state + queries + keys + values;
        let (cache, output) = match self.is_ring {
            true => (Region { offset: 0, len: cache }, observed),
            false => (Region { offset: observed, len: cache }, observed + cache),
        };
        let output = Region { offset: output, len: queries };
        let action = output.offset + output.len;
        let work = Region { offset: action + queries, len: self.cache.work_words() };
        let pair = |low: usize, high: usize| (low | high << 16) as u32;
        let Cache { heads, dim, slots, .. } = self.cache;
        let flag = |flag: bool| usize::from(flag);
        let mut words = vec![0; h::WORDS];
        if self.is_rotated {
            words.push(pair(self.heads, dim));
            words.extend((0..self.tokens).flat_map(|token| self.angles(token)).map(f32::to_bits));
        }
        let rotary = h::WORDS as u32;
        let [keep, attend] = [0, 2].map(|at| words.len() as u32 + at);
        words.extend([pair(heads, dim), pair(slots, flag(self.is_ring))]);
        words.extend([pair(self.heads, heads), pair(dim, slots), pair(flag(self.is_causal), 0), self.factor.to_bits()]);
        let queried = Region { offset: state, len: queries };
        let rotate = OpRecord { kind: OpKind::Rotary, dst: queried, src: 0, third: 0, bias: 0, data: rotary };
        let ops = words.len();
        let (src, third) = (state + queries, state + queries + keys);
        let keep = OpRecord { kind: OpKind::Keep, dst: cache, src, third, bias: 0, data: keep };
        let attend =
            OpRecord { kind: OpKind::Attend, dst: output, src: state, third: cache.offset, bias: 0, data: attend };
        let records = [rotate, keep, attend];
        let records = &records[usize::from(!self.is_rotated)..];
        for record in records {
            words.extend(record.emit().expect("small sizes"));
        }
        let header = Header {
            obs_len: observed - state,
            act_len: queries,
            scratch: work.offset + work.len,
            state: Region { offset: 0, len: state },
            observation: state,
            output: output.offset,
            action,
            work,
            ops: Records { offset: ops as u32, count: records.len() },
            ..header(words.len(), self.steps())
        };
        finish(words, header, |_| ())
    }
}

/// Runs `work` with a head of the image.
pub(crate) fn on_head<T>(words: &[u32], work: impl FnOnce(&mut Head<'_, '_>) -> T) -> T {
    let image = Image::new_checked(bytemuck::cast_slice(words)).expect("the image is valid");
    let mut scratch = vec![0; image.scratch_words()];
    work(&mut Head::new(image, &mut scratch).expect("enough memory"))
}
