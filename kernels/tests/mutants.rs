//! Random changes of a valid image, with a correct checksum. An image that passes `Image::new_checked` runs without a
//! panic, keeps its limits, and depends only on its observations. An image that changes after the check does not panic
//! either, nor one that passes only `Image::new_checksummed`. The tests need only this crate, so that they also run
//! with words of 32 bits and in Miri.

#[path = "common/attention.rs"]
mod attention;
#[path = "common/draft.rs"]
mod draft;

use std::panic::{AssertUnwindSafe, catch_unwind};

use actq_kernels::image::{Cache, header as h, op};
use actq_kernels::{Head, Image, StepError};
use actq_testkit::Random;
use attention::{Attention, Prefixed};
use draft::Draft;

/// Mutations in each test.
const CASES: u64 = if cfg!(miri) { 20 } else { 20_000 };

/// An image with every kind of section. A test in `host-tests/tests` writes the same bytes.
const VALID: &[u8] = include_bytes!("valid.actq");

/// Returns the valid images: that of all sections, and attention to a ring, to all tokens of a step, and to a prefix.
fn valid() -> Vec<Draft> {
    let cache = Cache { heads: 2, dim: 6, slots: 4, own: 0 };
    let ring = Attention { heads: 4, cache, tokens: 1, is_ring: true, is_causal: false, is_rotated: true, factor: 0.4 };
    let whole = Attention { tokens: 3, is_ring: false, is_causal: true, ..ring };
    let attentions = [ring, whole].map(|attention| Draft(attention.image()));
    let caches = vec![cache, Cache { own: 3, ..cache }];
    let prefixed = Prefixed { heads: 4, caches, tokens: 3, is_causal: false, factor: 0.4 };
    let images = attentions.into_iter().chain([Draft(prefixed.image())]);
    [Draft::of(VALID)].into_iter().chain(images).collect()
}

/// Returns the words with the image's structure: header, operation, matrix and block records, sizes of attention.
fn structure(draft: &Draft) -> Vec<usize> {
    let (first, count) = (draft.offset(h::W_OPS), draft.high(h::W_KIND) as usize);
    let ops = first..first + count * h::OP_WORDS;
    let linear = ops.clone().step_by(h::OP_WORDS).filter(|at| draft.get(*at) as u8 == op::LINEAR);
    let matrix = |op: usize| {
        let at = draft.offset(op + 3);
        let (blocks, count) = (draft.offset(at + 3), draft.low(at + 2) as usize);
        (at..at + h::MATRIX_WORDS).chain(blocks..blocks + count * h::BLOCK_WORDS)
    };
    let header = (h::W_KIND..h::W_DIGEST).chain(h::W_MATRICES..h::WORDS);
    let is_attention = |at: &usize| [op::KEEP, op::ATTEND, op::ROTARY].contains(&(draft.get(*at) as u8));
    let sizes = ops.clone().step_by(h::OP_WORDS).filter(is_attention).flat_map(|at| (0..4).map(move |i| (at, i)));
    let sizes = sizes.map(|(at, i)| draft.offset(at + 3) + i);
    header.chain(ops.clone()).chain(linear.flat_map(matrix)).chain(sizes).collect()
}

/// Changes up to three words at random, mostly words of the structure.
fn mutate(random: &mut Random, draft: &mut Draft, structure: &[usize]) {
    for _ in 0..1 + random.below(3) {
        let at = match random.below(4) {
            0 => h::W_KIND + random.below(draft.0.len() - h::W_KIND),
            _ => structure[random.below(structure.len())],
        };
        let (old, bits) = (draft.get(at), random.bits());
        let new = match random.below(6) {
            0 => bits as u32,
            1 => old ^ 1 << (bits % 32),
            2 => old.wrapping_add((bits as u32 % 65).wrapping_sub(32)) ^ (bits as u32 & 0x1_0000),
            3 => draft.get(random.below(draft.0.len())),
            4 => old & !(0xffff << (bits % 2 * 16)) | ((bits >> 8) as u32 % 256) << (bits % 2 * 16),
            _ => [0, 1, u32::MAX, 0x7f80_0000, 0xff80_0000, 0x7fc0_0000, 0x7f7f_ffff, 0x0000_0001][bits as usize % 8],
        };
        draft.set(at, new);
    }
    draft.seal();
}

/// Returns the mutations of a test: the number of the case, its random numbers, and the image.
fn mutations() -> impl Iterator<Item = (u64, Random, Draft)> {
    let valid: Vec<_> = valid().into_iter().map(|draft| (structure(&draft), draft)).collect();
    (0..CASES).map(move |case| {
        // Every other case is of the first.
        let (structure, draft) = &valid[if case % 2 == 0 { 0 } else { case as usize / 2 % valid.len() }];
        let (mut random, mut draft) = (Random::new(case), draft.clone());
        mutate(&mut random, &mut draft, structure);
        (case, random, draft)
    })
}

/// Passes each accepted mutation to `see` and returns their number. If `see` panics, the test fails with the numbers of
/// all such cases.
fn accepted(see: impl Fn(Image<'_>, &mut Random)) -> u64 {
    let (mut seen, mut failed) = (0, Vec::new());
    for (case, mut random, draft) in mutations() {
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let image = Image::new_checked(draft.bytes()).ok();
            image.map(|image| see(image, &mut random)).is_some()
        }));
        match outcome {
            Ok(accepted) => seen += u64::from(accepted),
            Err(_) => failed.push(case),
        }
    }
    assert!(failed.is_empty(), "cases {failed:?}");
    seen
}

/// Runs three steps and the self-test, in memory of exactly the image's size that is filled with `fill`. Returns the
/// bits of the actions.
fn play(image: Image<'_>, fill: u32, random: &mut Random) -> Vec<Option<Vec<u32>>> {
    let mut scratch = vec![fill; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch).expect("the scratch memory has the image's size");
    head.set_test_prefix();
    let mut step = || {
        let observation: Vec<f32> = (0..image.obs_len()).map(|_| 3.0 * random.unit()).collect();
        head.step(&observation).ok().map(|action| action.iter().map(|a| a.to_bits()).collect())
    };
    let actions = vec![step(), step(), step()];
    let _ = head.self_test();
    actions
}

#[test]
fn accepted_images_keep_their_limits() {
    let seen = accepted(|image, random| {
        let [_, _, low, high, ..] = image.contract_arrays();
        let limit = |array: &[u32], i: usize| array.get(i).map(|w| f32::from_bits(u32::from_le(*w)));
        let fill = random.bits() as u32;
        for action in play(image, fill, random).into_iter().flatten() {
            for (i, a) in action.into_iter().map(f32::from_bits).enumerate() {
                assert!(a.is_finite(), "action {i} is {a}");
                assert!(limit(low, i).is_none_or(|low| a >= low), "action {i} is {a}, below its limit");
                assert!(limit(high, i).is_none_or(|high| a <= high), "action {i} is {a}, above its limit");
            }
        }
    });
    assert!(seen > CASES / 20, "{seen} images were accepted: too few to show anything");
}

#[test]
fn old_memory_does_not_change_actions() {
    accepted(|image, random| {
        let other = play(image, 0x3f80_0000, &mut random.clone());
        assert_eq!(play(image, 0, random), other);
    });
}

#[test]
fn a_reset_clears_everything() {
    accepted(|image, random| {
        let mut scratch = vec![0; image.scratch_words()];
        let mut head = Head::new(image, &mut scratch).expect("the scratch memory has the image's size");
        head.set_test_prefix();
        let observations: Vec<Vec<f32>> =
            (0..3).map(|_| (0..image.obs_len()).map(|_| 3.0 * random.unit()).collect()).collect();
        let mut play = || {
            head.reset();
            let step = |o: &Vec<f32>| head.step(o).map(|action| action.iter().map(|a| a.to_bits()).collect::<Vec<_>>());
            observations.iter().map(step).collect::<Vec<_>>()
        };
        assert_eq!(play(), play());
    });
}

#[test]
fn damage_after_the_check_does_not_panic() {
    let scratch = valid().iter().map(|draft| draft.get(h::W_SCRATCH)).max().expect("there are images");
    let mut outcomes = [0; 2];
    for (case, _, mut draft) in mutations() {
        // The head's memory stays as the header had it.
        draft.set(h::W_SCRATCH, scratch);
        let image = Image::unchecked(draft.bytes()).expect("the header is there");
        let mut scratch = vec![0; image.scratch_words()];
        let mut head = Head::new(image, &mut scratch).expect("the scratch memory has the image's size");
        let observation = vec![0.5; image.obs_len()];
        head.set_test_prefix();
        let outcome = catch_unwind(AssertUnwindSafe(|| (0..3).all(|_| head.step(&observation).is_ok())));
        outcomes[usize::from(outcome.unwrap_or_else(|_| panic!("case {case}")))] += 1;
    }
    assert!(outcomes.iter().all(|n| *n > CASES / 20), "{outcomes:?}: too few to show anything");
}

#[test]
fn any_content_with_checksum_does_not_panic() {
    // Refused by both, only by the whole check, and by none.
    let mut outcomes = [0; 3];
    for (case, mut random, draft) in mutations() {
        let checked = Image::new_checked(draft.bytes()).is_ok();
        let image = Image::new_checksummed(draft.bytes());
        assert!(image.is_ok() || !checked, "case {case}: {}", image.unwrap_err());
        // Of an image with a damaged length, which no head has the memory for.
        let image = image.ok().filter(|image| image.scratch_words() < 1 << 16);
        let played = image.map(|image| catch_unwind(AssertUnwindSafe(|| play(image, 0, &mut random))).is_ok());
        assert!(played != Some(false), "case {case}");
        outcomes[usize::from(image.is_some()) + usize::from(checked)] += 1;
    }
    assert!(outcomes.iter().all(|n| *n > CASES / 20), "{outcomes:?}: too few to show anything");
}

#[test]
fn a_self_test_without_steps_is_no_success() {
    let mut draft = Draft::of(VALID);
    draft.set(h::W_SELF_TEST, draft.0.len() as u32);
    draft.seal();
    let image = Image::new_checksummed(draft.bytes()).expect("only its content is wrong");
    let mut scratch = vec![0; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch).expect("enough memory");
    assert_eq!(head.self_test(), Err(StepError::Damaged));
}
