//! Attention against its exact value, and against a plain program of `docs/FORMAT.md`, bit by bit.
#![expect(clippy::expect_used, reason = "a test")]

#[path = "common/attention.rs"]
mod common;

use std::collections::VecDeque;
use std::task::Poll;

use actq_kernels::activations::Scale;
use actq_kernels::image::Cache;
use actq_kernels::math::exp;
use actq_kernels::{Head, Image, PrefixError, StepError};
use actq_testkit::Random;
use common::{Attention, Prefixed, on_head, own_len};

/// Attentions in each test.
const CASES: usize = if cfg!(miri) { 4 } else { 600 };

/// A key and a value of a head.
type Pair = (Vec<f32>, Vec<f32>);

/// Returns the tokens that a query sees: for each, the keys and values of the heads.
fn tokens(attention: &Attention, observation: &[f32]) -> Vec<Vec<Pair>> {
    let (dim, [queries, keys, _]) = (attention.cache.dim, attention.lengths());
    let (keys, values) = observation[queries..].split_at(keys);
    let pairs = keys.chunks(dim).zip(values.chunks(dim)).map(|(k, v)| (k.to_vec(), v.to_vec()));
    pairs.collect::<Vec<_>>().chunks(attention.cache.heads).map(<[_]>::to_vec).collect()
}

/// The slots of a cache, as they are after each step.
struct Slots {
    tokens: Vec<Vec<Pair>>,
    next: usize,
}

impl Slots {
    fn keep(&mut self, attention: &Attention, observation: &[f32]) {
        let new = tokens(attention, observation);
        if !attention.is_ring {
            self.tokens = new;
        } else if self.tokens.len() < attention.cache.slots {
            self.tokens.extend(new);
        } else {
            self.tokens[self.next] = new.into_iter().next().expect("one token");
            self.next = (self.next + 1) % attention.cache.slots;
        }
    }

    /// Returns the keys and values of a head that a query of token `token` sees.
    fn seen(&self, attention: &Attention, token: usize, head: usize) -> Vec<&Pair> {
        let hidden = if attention.is_causal { attention.tokens - 1 - token } else { 0 };
        let shared = head / (attention.heads / attention.cache.heads);
        self.tokens[..self.tokens.len().saturating_sub(hidden)].iter().map(|token| &token[shared]).collect()
    }
}

fn integers(x: &[f32], max: u16) -> (Vec<i64>, f32) {
    let scale = Scale::new(x, max).expect("all values are finite");
    (x.iter().map(|x| i64::from((x * scale.inverse()).round_ties_even() as i32)).collect(), scale.get())
}

fn dot(a: &[i64], b: &[i64]) -> i64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Computes a head's output as `docs/FORMAT.md` says.
fn plain(factor: f32, query: &[f32], seen: &[&Pair]) -> Vec<f32> {
    let (q, q_scale) = integers(query, 127);
    let kept: Vec<_> = seen.iter().map(|(key, value)| (integers(key, 127), integers(value, 127))).collect();
    let scores: Vec<f32> =
        kept.iter().map(|((key, scale), _)| dot(&q, key) as f32 * (factor * q_scale * scale)).collect();
    let max = scores.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let powers: Vec<f32> = scores.iter().map(|score| exp(score - max)).collect();
    let weights: Vec<f32> = powers.iter().zip(&kept).map(|(power, (_, (_, scale)))| power * scale).collect();
    let sum = |x: &[f32]| x.iter().fold(0.0f32, |sum, x| sum + x);
    let total = Scale::of_magnitude(sum(&weights).to_bits(), 32767).expect("a finite sum");
    let p: Vec<i64> = weights.iter().map(|w| i64::from((w * total.inverse()).round_ties_even() as i32)).collect();
    let scale = total.get() / sum(&powers);
    let column = |i: usize| kept.iter().map(|(_, (value, _))| value[i]).collect::<Vec<_>>();
    let sums: Vec<i64> = (0..query.len()).map(|i| dot(&p, &column(i))).collect();
    assert!(sums.iter().all(|sum| sum.unsigned_abs() < 1 << 23), "{sums:?}");
    sums.iter().map(|sum| *sum as f32 * scale).collect()
}

/// Computes a head's exact output, and the largest error that the rounding of its inputs and weights explains.
fn exact(factor: f32, query: &[f32], seen: &[&Pair]) -> (Vec<f64>, f64) {
    let largest = |x: &[f32]| x.iter().fold(0.0f64, |m, x| m.max(f64::from(x.abs())));
    let ones = |x: &[f32]| x.iter().map(|x| f64::from(x.abs())).sum::<f64>();
    let factor = f64::from(factor);
    let score = |key: &[f32]| factor * query.iter().zip(key).map(|(q, k)| f64::from(*q) * f64::from(*k)).sum::<f64>();
    let scores: Vec<f64> = seen.iter().map(|(key, _)| score(key)).collect();
    let max = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let powers: Vec<f64> = scores.iter().map(|score| (score - max).exp()).collect();
    let sum: f64 = powers.iter().sum();
    let outputs = (0..query.len())
        .map(|i| powers.iter().zip(seen).map(|(p, (_, value))| p / sum * f64::from(value[i])).sum())
        .collect();
    // Half a step of a query and of each key, and a score's roundings in f32.
    let of_score = |key: &[f32]| {
        let steps = largest(query) / 254.0 * ones(key) + largest(key) / 254.0 * ones(query);
        factor * (steps + query.len() as f64 * largest(query) * largest(key) / 254.0 / 254.0)
    };
    let error = seen.iter().map(|(key, _)| of_score(key)).fold(0.0, f64::max) + 1e-5 * (1.0 + max.abs());
    let shift = (2.0 * error).exp();
    let values: f64 = powers.iter().zip(seen).map(|(p, (_, value))| p / sum * largest(value)).sum();
    // A value's half step; a weight's, which is half of 1/32767 of the sum; the weights' shift; and roundings in f32.
    let weights = seen.len() as f64 * 0.5 / 32767.0 * shift * values;
    (outputs, (shift - 1.0) * values + shift * values / 254.0 + weights + 1e-5 * values)
}

fn observation(random: &mut Random, attention: &Attention) -> Vec<f32> {
    let size = [1.0, 4.0, 1e-3, 100.0][random.below(4)];
    (0..attention.lengths().iter().sum()).map(|_| size * random.unit()).collect()
}

/// Steps of an attention, and what each sees.
fn run(random: &mut Random, attention: &Attention, mut see: impl FnMut(&[f32], &Slots, &[f32])) {
    on_head(&attention.image(), |head| {
        for _ in 0..2 {
            let mut slots = Slots { tokens: Vec::new(), next: 0 };
            head.reset();
            for _ in 0..if attention.is_ring { 2 * attention.cache.slots + 3 } else { 2 } {
                let observation = observation(random, attention);
                slots.keep(attention, &observation);
                let action = head.step(&observation).expect("all is finite").to_vec();
                see(&observation, &slots, &action);
            }
        }
    });
}

/// Calls `see` with the query, the tokens that it sees, and the output of every head.
fn heads(
    attention: &Attention,
    observation: &[f32],
    slots: &Slots,
    action: &[f32],
    see: impl Fn(&[f32], &[&Pair], &[f32]),
) {
    let dim = attention.cache.dim;
    for (unit, (query, y)) in attention.queries(observation).chunks(dim).zip(action.chunks(dim)).enumerate() {
        see(query, &slots.seen(attention, unit / attention.heads, unit % attention.heads), y);
    }
}

#[test]
fn outputs_have_the_documented_bits() {
    let mut random = Random::new(1);
    for _ in 0..CASES / 10 {
        let attention = Attention::draw(&mut random);
        run(&mut random, &attention, |observation, slots, action| {
            heads(&attention, observation, slots, action, |query, seen, y| {
                let bits = |x: &[f32]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(y), bits(&plain(attention.factor, query, seen)), "{attention:?}");
            });
        });
    }
}

#[test]
fn outputs_are_near_the_exact_ones() {
    let mut random = Random::new(2);
    for _ in 0..CASES / 10 {
        let attention = Attention::draw(&mut random);
        run(&mut random, &attention, |observation, slots, action| {
            heads(&attention, observation, slots, action, |query, seen, y| {
                let (exact, bound) = exact(attention.factor, query, seen);
                for (y, exact) in y.iter().zip(exact) {
                    assert!((f64::from(*y) - exact).abs() <= bound, "{y} for {exact}, within {bound}: {attention:?}");
                }
            });
        });
    }
}

#[test]
fn the_largest_sizes_fit_their_sums() {
    // All integers at one end of their range.
    let cache = Cache { heads: 1, dim: 120, slots: 512, own: 0 };
    let attention =
        Attention { heads: 1, cache, tokens: 1, is_ring: true, is_causal: false, is_rotated: false, factor: 1e-6 };
    let wide = Attention { cache: Cache { heads: 1, dim: 512, slots: 120, own: 0 }, ..attention };
    for attention in [attention, wide] {
        let observation = vec![-1.0; attention.lengths().iter().sum()];
        on_head(&attention.image(), |head| {
            for _ in 0..attention.cache.slots + 1 {
                let action = head.step(&observation).expect("all is finite");
                assert!(action.iter().all(|y| (y + 1.0).abs() < 0.01), "{action:?}");
            }
        });
    }
}

#[test]
fn slices_give_the_same_bits() {
    let mut random = Random::new(3);
    for _ in 0..CASES / 10 {
        let attention = Attention::draw(&mut random);
        let observations: Vec<_> = (0..4).map(|_| observation(&mut random, &attention)).collect();
        on_head(&attention.image(), |head| {
            let whole: Vec<_> = observations.iter().map(|x| head.step(x).map(<[f32]>::to_vec)).collect();
            head.reset();
            let mut most = 0;
            for (observation, whole) in observations.iter().zip(whole) {
                let (action, polls) = in_polls(head, observation);
                assert_eq!(action, whole, "{attention:?}");
                most = most.max(polls);
            }
            assert!(most > 1);
        });
    }
}

/// Runs a step in polls of the least budget, and returns their number.
fn in_polls(head: &mut Head<'_, '_>, observation: &[f32]) -> (Result<Vec<f32>, StepError>, usize) {
    let budget = head.least_budget();
    if let Err(error) = head.begin(observation) {
        return (Err(error), 0);
    }
    for polls in 1.. {
        match head.poll(budget) {
            Ok(Poll::Ready(action)) => return (Ok(action.to_vec()), polls),
            Ok(Poll::Pending) => {}
            Err(error) => return (Err(error), polls),
        }
    }
    unreachable!()
}

#[test]
fn an_overflow_fails_the_step_and_is_forgotten() {
    let cache = Cache { heads: 1, dim: 3, slots: 4, own: 0 };
    let attention =
        Attention { heads: 1, cache, tokens: 1, is_ring: true, is_causal: false, is_rotated: false, factor: 1.0 };
    let finite = [1.0f32; 9];
    on_head(&attention.image(), |head| {
        let first = head.step(&finite).map(<[f32]>::to_vec).expect("all is finite");
        // Scores of both signs that are not finite.
        for sign in [1.0, -1.0] {
            let mut large = [1e30f32; 9];
            large[..3].fill(sign * 1e30);
            head.step(&finite).expect("all is finite");
            assert_eq!(head.step(&large), Err(StepError::NotFinite));
            assert!(head.state_mut().iter().all(|word| word.to_bits() == 0), "the error resets the cache");
            assert_eq!(head.step(&finite), Ok(&first[..]), "nothing of it is left");
        }
        // A key, a query and a value that are not finite cannot come from an observation; from an operation they can.
        let len = head.image().obs_len();
        for i in 0..len {
            for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut observation = finite;
                observation[i] = wrong;
                assert_eq!(head.step(&observation), Err(StepError::ObservationNotFinite { index: i }));
            }
        }
        // Values as large as any are no overflow.
        let mut large = [1.0f32; 9];
        large[6..].fill(1e38);
        for _ in 0..6 {
            head.reset();
            let action = head.step(&large).expect("the output is as large as the values").to_vec();
            assert!(action.iter().all(|y| (y / 1e38 - 1.0).abs() < 0.01), "{action:?}");
        }
    });
}

#[test]
fn the_self_test_wraps_around() {
    let mut random = Random::new(6);
    for _ in 0..CASES / 30 {
        on_head(&Attention::draw(&mut random).image(), |head| assert_eq!(head.self_test(), Ok(())));
    }
}

#[test]
fn zeros_have_equal_weights() {
    let cache = Cache { heads: 2, dim: 4, slots: 3, own: 0 };
    let attention =
        Attention { heads: 4, cache, tokens: 3, is_ring: false, is_causal: true, is_rotated: false, factor: 0.5 };
    let [queries, keys, values] = attention.lengths();
    let mut observation = vec![0.0; queries + keys];
    // Each token's values are its number.
    observation.extend((0..values).map(|i| (i / 8 + 1) as f32));
    on_head(&attention.image(), |head| {
        let action = head.step(&observation).expect("all is finite");
        for (token, outputs) in action.chunks(16).enumerate() {
            let mean = (token + 2) as f32 / 2.0;
            assert!(outputs.iter().all(|y| (y - mean).abs() < 1e-3), "token {token}: {outputs:?}");
        }
        assert!(head.step(&vec![0.0; queries + keys + values]).expect("all is finite").iter().all(|y| *y == 0.0));
    });
}

#[test]
fn a_cache_of_any_content_does_not_panic() {
    let mut random = Random::new(4);
    for _ in 0..CASES {
        let attention = Attention { is_ring: true, tokens: 1, ..Attention::draw(&mut random) };
        let observation = observation(&mut random, &attention);
        on_head(&attention.image(), |head| {
            let bits: VecDeque<u32> = (0..head.state_mut().len()).map(|_| random.bits() as u32).collect();
            for (word, bits) in head.state_mut().iter_mut().zip(bits) {
                *word = f32::from_bits(bits);
            }
            for _ in 0..3 {
                if let Ok(action) = head.step(&observation) {
                    assert!(action.iter().all(|y| y.is_finite()), "{action:?}");
                }
            }
        });
    }
}

/// Returns the outputs of a prefix's attentions, the queries of each but the first being the outputs before it.
fn plain_prefixed(prefixed: &Prefixed, observation: &[f32], keys_and_values: &[[Vec<f32>; 2]]) -> Vec<f32> {
    let (queries, mut own) = observation.split_at(prefixed.len());
    let mut outputs = queries.to_vec();
    for (cache, [keys, values]) in prefixed.caches.iter().zip(keys_and_values) {
        let mut part = || own.split_off(..own_len(cache)).expect("keys or values of its own");
        let (keys, values) = ([keys, part()].concat(), [values, part()].concat());
        let heads: Vec<Pair> =
            keys.chunks(cache.dim).zip(values.chunks(cache.dim)).map(|(k, v)| (k.to_vec(), v.to_vec())).collect();
        let of_unit = |(unit, query): (usize, &[f32])| {
            let shared = unit % prefixed.heads / (prefixed.heads / cache.heads);
            let later = if prefixed.is_causal { prefixed.tokens - 1 - unit / prefixed.heads } else { 0 };
            let all: Vec<&Pair> = heads.iter().skip(shared).step_by(cache.heads).collect();
            plain(prefixed.factor, query, &all[..all.len() - later])
        };
        outputs = outputs.chunks(cache.dim).enumerate().flat_map(of_unit).collect();
    }
    outputs
}

fn drawn(random: &mut Random, len: usize) -> Vec<f32> {
    (0..len).map(|_| random.unit()).collect()
}

#[test]
fn a_prefix_gives_the_documented_bits() {
    let mut random = Random::new(7);
    for _ in 0..CASES / 10 {
        let prefixed = Prefixed::draw(&mut random);
        on_head(&prefixed.image(), |head| {
            assert!(head.image().prefix_caches().eq(prefixed.caches.iter().copied()));
            for _ in 0..3 {
                let keys_and_values = prefixed.keys_and_values(&mut random);
                head.set_prefix(&prefixed.bytes(&keys_and_values)).expect("it is the image's");
                // It stays over steps, slices and a reset.
                for _ in 0..2 {
                    let observation = drawn(&mut random, prefixed.obs_len());
                    let expected = plain_prefixed(&prefixed, &observation, &keys_and_values);
                    assert_eq!(head.step(&observation), Ok(&expected[..]), "{prefixed:?}");
                    assert_eq!(in_polls(head, &observation).0, Ok(expected), "{prefixed:?}");
                    head.reset();
                }
            }
        });
    }
}

/// Two caches, and the words before the second.
fn two() -> (Prefixed, usize) {
    let cache = Cache { heads: 2, dim: 3, slots: 5, own: 0 };
    let caches = vec![cache, Cache { slots: 3, ..cache }];
    let prefixed = Prefixed { heads: 4, caches, tokens: 2, is_causal: false, factor: 0.5 };
    (prefixed, cache.words())
}

#[test]
fn without_a_prefix_no_step_runs() {
    let (prefixed, _) = two();
    let mut random = Random::new(8);
    let bytes = prefixed.bytes(&prefixed.keys_and_values(&mut random));
    let observation = drawn(&mut random, prefixed.len());
    on_head(&prefixed.image(), |head| {
        assert_eq!(head.step(&observation), Err(StepError::NoPrefix));
        assert_eq!(head.infer(&observation), Err(StepError::NoPrefix));
        assert_eq!(head.begin(&observation), Err(StepError::NoPrefix));
        assert!(!head.has_prefix());
        head.set_prefix(&bytes).expect("it is the image's");
        let action = head.step(&observation).expect("all is finite").to_vec();
        head.clear_prefix();
        assert_eq!(head.step(&observation), Err(StepError::NoPrefix));
        // The self-test has its own, which no step uses.
        assert_eq!(head.self_test(), Ok(()));
        assert_eq!(head.step(&observation), Err(StepError::NoPrefix));
        head.set_prefix(&bytes).expect("it is the image's");
        assert_eq!(head.step(&observation), Ok(&action[..]));
        let mut saved = vec![0; head.saved_len()];
        head.save(&mut saved).expect("no step has begun");
        head.clear_prefix();
        head.restore(&saved).expect("it is this head's");
        assert_eq!(head.step(&observation), Ok(&action[..]), "a saved state has the prefix");
        // A step that has begun keeps its prefix, or is dropped with it.
        head.begin(&observation).expect("all is finite");
        assert_eq!(head.set_prefix(&bytes), Err(PrefixError::Begun));
        head.clear_prefix();
        assert_eq!(head.poll(u32::MAX), Err(StepError::NotBegun));
    });
    let plain = Attention::draw(&mut random);
    on_head(&plain.image(), |head| {
        assert!(head.has_prefix() && head.image().prefix_bytes() == 0, "it needs none");
        assert_eq!(head.set_prefix(&[]), Ok(()));
        assert_eq!(head.set_prefix(&[0; 4]), Err(PrefixError::Length { needed: 0, given: 4 }));
    });
}

#[test]
fn a_wrong_prefix_leaves_the_one_before() {
    let (prefixed, second) = two();
    let mut random = Random::new(9);
    let bytes = prefixed.bytes(&prefixed.keys_and_values(&mut random));
    let observation = drawn(&mut random, prefixed.len());
    on_head(&prefixed.image(), |head| {
        head.set_prefix(&bytes).expect("it is the image's");
        let action = head.step(&observation).expect("all is finite").to_vec();
        let with = |at: usize, word: u32| {
            let mut wrong = bytes.clone();
            wrong[4 * at..4 * at + 4].copy_from_slice(&word.to_le_bytes());
            wrong
        };
        let scale = |x: f32| with(second + 12, x.to_bits());
        let cases = [
            (bytes[4..].to_vec(), PrefixError::Length { needed: bytes.len(), given: bytes.len() - 4 }),
            (with(0, 0), PrefixError::Tokens),
            (with(0, 6), PrefixError::Tokens),
            (with(second, 4), PrefixError::Tokens),
            (with(second, u32::MAX), PrefixError::Tokens),
            (scale(f32::NAN), PrefixError::NotFinite),
            (scale(f32::INFINITY), PrefixError::NotFinite),
            (scale(-1.0), PrefixError::NotFinite),
            (with(1, (-0.0f32).to_bits()), PrefixError::NotFinite),
        ];
        for (wrong, error) in cases {
            assert_eq!(head.set_prefix(&wrong), Err(error));
            assert_eq!(head.step(&observation), Ok(&action[..]), "{error}");
        }
        // Integers of any bits do not panic.
        for _ in 0..CASES {
            let mut any = bytes.clone();
            for (i, byte) in any.iter_mut().enumerate() {
                let (word, first) = (i / 4, if i / 4 >= second { second } else { 0 });
                // Not the count and the scales.
                let scales = if first == 0 { 20 } else { 12 };
                if word > first + scales {
                    *byte = random.bits() as u8;
                }
            }
            head.set_prefix(&any).expect("its counts and scales are as before");
            assert!(head.step(&observation).is_ok_and(|action| action.iter().all(|y| y.is_finite())));
        }
    });
}

#[test]
fn only_whole_finite_tokens_fill_a_cache() {
    let cache = Cache { heads: 2, dim: 3, slots: 4, own: 0 };
    let mut words = vec![0; cache.words()];
    let length = |given| Err(PrefixError::Length { needed: 24, given });
    assert_eq!(cache.fill(&[1.0; 24], &[1.0; 24], &mut words), Ok(()));
    assert_eq!(words[0], 4);
    assert_eq!(cache.fill(&[1.0; 6], &[1.0; 6], &mut words), Ok(()));
    assert_eq!(words[0], 1);
    assert_eq!(cache.fill(&[1.0; 6], &[1.0; 6], &mut words[1..]), length(6));
    assert_eq!(cache.fill(&[1.0; 7], &[1.0; 7], &mut words), length(7));
    assert_eq!(cache.fill(&[1.0; 12], &[1.0; 6], &mut words), length(12));
    assert_eq!(cache.fill(&[], &[], &mut words), Err(PrefixError::Tokens));
    assert_eq!(cache.fill(&[1.0; 30], &[1.0; 30], &mut words), Err(PrefixError::Tokens));
    for wrong in [f32::NAN, f32::INFINITY] {
        assert_eq!(cache.fill(&[1.0, 1.0, wrong, 1.0, 1.0, 1.0], &[1.0; 6], &mut words), Err(PrefixError::NotFinite));
    }
    for cache in [Cache { heads: 0, ..cache }, Cache { dim: 0, ..cache }, Cache { slots: 0, ..cache }] {
        assert!(cache.fill(&[1.0; 6], &[1.0; 6], &mut words).is_err(), "{cache:?}");
    }
}

/// The integers and scales of a prefix are those that `keep` writes for the same keys and values.
#[test]
fn a_prefix_has_the_bits_of_keep() {
    let mut random = Random::new(10);
    for _ in 0..CASES / 30 {
        let kept = Attention { is_ring: false, is_rotated: false, is_causal: false, ..Attention::draw(&mut random) };
        let kept = Attention { tokens: kept.tokens.min(kept.cache.slots), ..kept };
        let observation = drawn(&mut random, kept.lengths().iter().sum());
        let (queries, rest) = observation.split_at(kept.lengths()[0]);
        let (keys, values) = rest.split_at(kept.lengths()[1]);
        let prefixed = Prefixed {
            heads: kept.heads,
            caches: vec![kept.cache],
            tokens: kept.tokens,
            is_causal: false,
            factor: kept.factor,
        };
        let bytes = prefixed.bytes(&[[keys.to_vec(), values.to_vec()]]);
        let expected = on_head(&kept.image(), |head| head.step(&observation).map(<[f32]>::to_vec));
        on_head(&prefixed.image(), |head| {
            head.set_prefix(&bytes).expect("it is the image's");
            assert_eq!(head.step(queries).map(<[f32]>::to_vec), expected, "{kept:?}");
        });
    }
}

#[test]
fn the_self_test_has_a_prefix() {
    let mut random = Random::new(11);
    for _ in 0..CASES / 30 {
        let words = Prefixed::draw(&mut random).image();
        on_head(&words, |head| assert_eq!(head.self_test(), Ok(())));
        let image = Image::new_checksummed(bytemuck::cast_slice(&words)).expect("it is whole");
        assert!(image.prefix_bytes() > 0);
    }
}
