//! Any calls of the C interface on any image, with pointers that are null or valid for their lengths: each gives a
//! status. Under AddressSanitizer, none reads or writes outside its buffers.
#![no_main]

use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use actq_c::*;
use actq_kernels::image::{checksum, seal};
use libfuzzer_sys::fuzz_target;

/// Instructions of the longest step to run, and words of the largest scratch memory.
const INSTRUCTIONS: u64 = 1_000_000;
const SCRATCH_WORDS: usize = 1 << 16;
/// Calls in a run.
const CALLS: usize = 40;

/// A buffer of exactly `len` values, whose neighbours AddressSanitizer guards.
fn buffer<T: Clone>(value: T, len: usize) -> Box<[T]> {
    vec![value; len].into_boxed_slice()
}

/// Bytes that decide.
struct Script<'a>(&'a [u8]);

impl Script<'_> {
    fn next(&mut self) -> usize {
        let (first, rest) = self.0.split_first().unwrap_or((&0, &[]));
        self.0 = rest;
        (*first).into()
    }

    /// A length: the right one, one less, one more, none, or another; never more than the buffer has.
    fn length(&mut self, right: usize, most: usize) -> usize {
        let options = self.next();
        [right, right, right.saturating_sub(1), right + 1, 0, options][options % 6].min(most)
    }
}

fn run(bytes: &[u8], script: &[u8]) {
    let mut script = Script(script);
    // At any address of a word.
    let offset = script.next() % 8;
    let mut memory = buffer(0u64, (offset + bytes.len()).div_ceil(8));
    let start = memory.as_mut_ptr().cast::<u8>().wrapping_add(offset);
    let mut image = Box::new(MaybeUninit::<ActqImage>::uninit());
    let mut head = Box::new(MaybeUninit::<ActqHead>::uninit());
    let (image, head) = (image.as_mut_ptr(), head.as_mut_ptr());
    // SAFETY: every pointer is null, or valid for the length beside it; the memory lives until the end.
    unsafe {
        std::ptr::copy_nonoverlapping(bytes.as_ptr(), start, bytes.len());
        let open = [actq_image_open, actq_image_open_checksummed][script.next() % 2];
        let opened = open(image, start, script.length(bytes.len(), bytes.len()));
        let (mut sizes, mut cost) = (Sizes::default(), CCost::default());
        actq_image_sizes(image, &mut sizes);
        if opened == 0 {
            actq_image_cost(image, &mut cost);
        }
        if cost.instructions > INSTRUCTIONS || sizes.scratch_words > SCRATCH_WORDS {
            return;
        }
        let words = script.length(sizes.scratch_words, SCRATCH_WORDS + 1);
        let mut scratch = buffer(0u32, words);
        let (obs, act) = (sizes.observation_len, sizes.action_len);
        let (observations, mut actions) = (buffer(0.5f32, obs + 256), buffer(0.0f32, act + 256));
        let mut saved = buffer(0u8, 4 * SCRATCH_WORDS + 256);
        let mut saved_bytes = 0;
        actq_head_init(head, image, scratch.as_mut_ptr(), words);
        for _ in 0..CALLS {
            let options = script.next();
            // A buffer, or one that must be refused: null, misaligned, or the head's own memory.
            let (o, a): (*const f32, *mut f32) = match options / 16 {
                0 => (null(), actions.as_mut_ptr()),
                1 => (observations.as_ptr(), null_mut()),
                2 => (observations.as_ptr().wrapping_byte_add(1), actions.as_mut_ptr()),
                3 => (observations.as_ptr(), actions.as_mut_ptr().wrapping_byte_add(2)),
                4 if words > 256 + obs.max(act) => (scratch.as_ptr().cast(), actions.as_mut_ptr()),
                5 if words > 256 + obs.max(act) => (observations.as_ptr(), scratch.as_mut_ptr().cast()),
                _ => (observations.as_ptr(), actions.as_mut_ptr()),
            };
            let (obs, act) = (script.length(obs, obs + 255), script.length(act, act + 255));
            let status = match options % 16 {
                0..4 => actq_step(head, o, obs, a, act),
                4 => actq_begin(head, o, obs),
                5 | 6 => actq_poll(head, cost.least_budget, a, act),
                7 => actq_poll(head, script.next() as u32, a, act),
                8 => actq_play(head, a, act),
                9 => actq_pass(head, script.next()),
                10 => actq_reset(head),
                11 => actq_seed(head, script.next() as u32),
                12 => {
                    actq_saved_bytes(head, &mut saved_bytes);
                    let bytes = script.length(saved_bytes, saved.len());
                    actq_save(head, saved.as_mut_ptr(), bytes)
                }
                13 => {
                    let bytes = script.length(saved_bytes, saved.len());
                    let at = script.next();
                    saved[at] ^= script.next() as u8;
                    // A right checksum, so that the checks after it are reached.
                    if script.next() % 2 == 0 {
                        let sum = checksum(&saved[..bytes]).to_le_bytes();
                        saved[12..16].copy_from_slice(&sum);
                    }
                    actq_restore(head, saved.as_ptr(), bytes)
                }
                14 => {
                    let mut port = MaybeUninit::uninit();
                    actq_image_port(image, script.next(), port.as_mut_ptr());
                    actq_set_input(image, c"q".as_ptr(), o, obs, actions.as_mut_ptr(), act)
                }
                _ => match script.next() % 4 {
                    0 => actq_clear_prefix(head),
                    1 => {
                        let mut bytes = 0;
                        actq_prefix_bytes(head, &mut bytes);
                        saved[script.next()] ^= script.next() as u8;
                        actq_set_prefix(head, saved.as_ptr(), script.length(bytes, saved.len()))
                    }
                    _ => actq_self_test(head),
                },
            };
            assert!(!actq_status_text(status).is_null());
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let (script, image) = bytes.split_at(bytes.len().min(4 * CALLS));
    run(image, script);
    let mut sealed = image.to_vec();
    if seal(&mut sealed).is_ok() {
        run(&sealed, script);
    }
});
