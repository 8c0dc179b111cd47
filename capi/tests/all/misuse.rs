//! Misuse with valid pointers and lengths, and null: each gives its error and changes nothing.

use std::ptr::{null, null_mut};

use actq_c::{
    ActqHead, ActqImage, CPort, Code, actq_begin, actq_head_init, actq_image_cost, actq_image_open,
    actq_image_open_checksummed, actq_image_port, actq_image_sizes, actq_least_budget, actq_pass, actq_play, actq_poll,
    actq_reset, actq_restore, actq_save, actq_saved_bytes, actq_seed, actq_self_test, actq_set_input, actq_step,
};
use actq_kernels::ImageError;

use super::{Aligned, BYTES, OK, Program};

/// The number of a code, or of an error of the kernels.
macro_rules! number {
    ($code:ident) => {
        Code::$code as i32
    };
    ($error:ident $code:ident) => {
        i32::from($error::$code.code())
    };
}

/// Checks the status of each call.
macro_rules! gives {
    ($($call:expr => $($code:ident)+;)*) => {
        // SAFETY: each pointer is null, or valid for its length.
        $(assert_eq!(unsafe { $call }, number!($($code)+), stringify!($call));)*
    };
}

#[test]
fn null_misaligned_and_short_buffers_are_errors() {
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let (observation, mut action) = (vec![0.5f32; obs + 1], vec![7.0f32; act + 1]);
    let (image, head) = (program.image(), program.head());
    let (o, a) = (observation.as_ptr(), action.as_mut_ptr());
    // One byte into a buffer that is longer.
    let (odd_o, odd_a) = (o.wrapping_byte_add(1), a.wrapping_byte_add(1));
    let bytes = BYTES.0.as_ptr();
    let scratch = program.scratch.as_mut_ptr();
    let words = program.scratch.len();
    let mut spare = vec![0u8; 64];
    let saved = spare.as_mut_ptr();
    let mut other = Program::start();
    let other_head = other.head();
    gives! {
        actq_step(null_mut(), o, obs, a, act) => Null;
        actq_step(head, null(), obs, a, act) => Null;
        actq_step(head, o, obs, null_mut(), act) => Null;
        actq_step(head, odd_o, obs, a, act) => Alignment;
        actq_step(head, o, obs, odd_a, act) => Alignment;
        actq_step(head.wrapping_byte_add(1), o, obs, a, act) => Alignment;
        actq_step(head, o, obs - 1, a, act) => ObservationLength;
        actq_step(head, o, 0, a, act) => ObservationLength;
        actq_step(head, o, usize::MAX, a, act) => ObservationLength;
        actq_save(head, saved, usize::MAX) => Length;
        actq_step(head, o, obs, a, act - 1) => Length;
        actq_step(head, o, obs, a, act + 1) => Length;
        actq_poll(head, u32::MAX, a, act) => NotBegun;
        actq_begin(head, null(), obs) => Null;
        actq_saved_bytes(head, null_mut()) => Null;
        actq_save(head, null_mut(), 100) => Null;
        actq_restore(head, null(), 100) => Null;
        actq_restore(head, saved, 3) => SavedLength;
        actq_image_open(null_mut(), bytes, 100) => Null;
        actq_image_open_checksummed(null_mut(), bytes, 100) => Null;
        actq_image_cost(image, null_mut()) => Null;
        actq_image_sizes(image, null_mut()) => Null;
        actq_image_cost(null(), null_mut()) => Null;
        actq_image_port(image, 0, null_mut()) => Null;
        actq_head_init(other_head, image, null_mut(), words) => Null;
        actq_head_init(other_head, image, scratch, 1) => ScratchTooSmall;
    }
    assert!(action.iter().all(|value| *value == 7.0), "an error writes no action");
}

#[test]
fn unopened_and_copied_structures_are_errors() {
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let (observation, mut action) = (vec![0.5f32; obs], vec![0.0f32; act]);
    let (o, a) = (observation.as_ptr(), action.as_mut_ptr());
    for filling in [0u8, 0xff, 0xa5] {
        let mut memory = vec![u64::from_ne_bytes([filling; 8]); 128];
        let (head, image) = (memory.as_mut_ptr().cast::<ActqHead>(), memory.as_ptr().cast::<ActqImage>());
        let mut port = std::mem::MaybeUninit::<CPort>::uninit();
        gives! {
            actq_step(head, o, obs, a, act) => NotInitialized;
            actq_reset(head) => NotInitialized;
            actq_image_port(image, 0, port.as_mut_ptr()) => NotInitialized;
        }
    }
    // A copy would share its memory with the original.
    let mut copy = std::mem::MaybeUninit::<ActqHead>::uninit();
    // SAFETY: both are valid, and as long.
    unsafe { std::ptr::copy_nonoverlapping(program.head(), copy.as_mut_ptr(), 1) };
    gives! {
        actq_step(copy.as_mut_ptr(), o, obs, a, act) => NotInitialized;
        actq_step(program.head(), o, obs, a, act) => Ok;
    }
    // A failed open closes what was open; so does a failed init.
    let (image, head) = (program.image(), program.head());
    gives! {
        actq_image_open(image, BYTES.0.as_ptr(), 8) => ImageError TooShort;
        actq_image_cost(image, null_mut()) => NotInitialized;
        actq_head_init(head, image, program.scratch.as_mut_ptr(), program.scratch.len()) => NotInitialized;
        actq_step(head, o, obs, a, act) => NotInitialized;
    }
}

#[test]
fn overlapping_buffers_are_errors() {
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let mut values = vec![0.5f32; obs + act];
    let (image, head) = (program.image(), program.head());
    let scratch = program.scratch.as_mut_ptr();
    let words = program.scratch.len();
    let (in_scratch, in_head) = (scratch.cast::<f32>(), head.cast::<f32>());
    let v = values.as_mut_ptr();
    gives! {
        actq_step(head, in_scratch, obs, v, act) => Overlap;
        actq_step(head, v, obs, in_scratch, act) => Overlap;
        actq_step(head, v, obs, in_head, act) => Overlap;
        actq_begin(head, in_head, obs) => Overlap;
        actq_save(head, scratch.cast(), 4) => Overlap;
        actq_saved_bytes(head, head.cast()) => Overlap;
        actq_step(head, v, obs, BYTES.0.as_ptr().cast::<f32>().cast_mut(), act) => Overlap;
        actq_image_sizes(image, image.cast()) => Overlap;
        actq_step(head, v, obs, v, act) => Overlap;
        actq_step(head, v, obs, v.wrapping_add(obs - 1), act) => Overlap;
        actq_step(head, v.wrapping_add(act - 1), obs, v, act) => Overlap;
        actq_step(head, v, obs, v.wrapping_add(obs), act) => Ok;
        actq_step(head, v.wrapping_add(act), obs, v, act) => Ok;
        actq_head_init(head, image, image.cast(), 4) => Overlap;
        actq_head_init(head, image, BYTES.0.as_ptr().cast::<u32>().cast_mut(), 4) => Overlap;
        actq_head_init(head, image, scratch, words) => Ok;
        actq_image_open(image, image.cast(), 40) => Overlap;
        actq_image_open_checksummed(image, image.cast(), 40) => Overlap;
    }
}

/// Every call on a head is an error once another one was initialized in its scratch memory, or in a part of it that it
/// writes, until it is initialized in its own again.
#[test]
fn scratch_memory_belongs_to_the_last_head() {
    let (mut first, mut second) = (Program::start(), Program::start());
    let (obs, act) = first.lengths();
    let (observation, mut action) = (vec![0.5f32; obs], vec![7.0f32; act]);
    let (o, a) = (observation.as_ptr(), action.as_mut_ptr());
    let words = first.scratch.len();
    let mut shared = vec![0u32; 2 * words];
    let shared = shared.as_mut_ptr();
    let (image, one, other) = (first.image(), first.head(), second.head());
    let mut number = 0;
    gives! {
        actq_head_init(one, image, shared, words - 1) => ScratchTooSmall;
        actq_head_init(one, image, shared, words) => Ok;
        actq_step(one, o, obs, a, act) => Ok;
        actq_begin(one, o, obs) => Ok;
        actq_head_init(other, image, shared, words) => Ok;
        actq_poll(one, u32::MAX, a, act) => ScratchTaken;
        actq_step(one, o, obs, a, act) => ScratchTaken;
        actq_begin(one, o, obs) => ScratchTaken;
        actq_play(one, a, act) => ScratchTaken;
        actq_reset(one) => ScratchTaken;
        actq_seed(one, 1) => ScratchTaken;
        actq_pass(one, 1) => ScratchTaken;
        actq_self_test(one) => ScratchTaken;
        actq_least_budget(one, &mut number) => ScratchTaken;
        actq_saved_bytes(one, null_mut()) => ScratchTaken;
        actq_save(one, null_mut(), 0) => ScratchTaken;
        actq_restore(one, null(), 0) => ScratchTaken;
        actq_self_test(other) => Ok;
        actq_head_init(one, image, shared.wrapping_add(words), words) => Ok;
        actq_self_test(one) => Ok;
        actq_self_test(other) => Ok;
        // The end of one head's memory is the begin of the other's.
        actq_head_init(other, image, shared.wrapping_add(words + 1), words - 1) => ScratchTooSmall;
        actq_head_init(other, image, shared.wrapping_add(1), words) => Ok;
        actq_step(one, o, obs, a, act) => ScratchTaken;
        actq_self_test(other) => Ok;
    }
}

/// A structure where the caller's other memory lies.
#[test]
fn overlapping_structures_are_refused_before_any_write() {
    let mut program = Program::start();
    let mut bytes = Box::new(Aligned(BYTES.0));
    let in_bytes = bytes.0.as_mut_ptr().wrapping_add(64);
    let scratch = program.scratch.as_mut_ptr();
    let words = program.scratch.len();
    let (image, mut other) = (program.image(), Box::new(std::mem::MaybeUninit::<ActqImage>::zeroed()));
    let other = other.as_mut_ptr();
    gives! {
        actq_image_open(in_bytes.cast(), bytes.0.as_ptr(), bytes.0.len()) => Overlap;
        actq_image_open(other, bytes.0.as_ptr(), bytes.0.len()) => Ok;
        actq_head_init(in_bytes.cast(), other, scratch, words) => Overlap;
        actq_head_init(other.cast(), other, scratch, words) => Overlap;
        actq_head_init(scratch.cast(), image, scratch, words) => Overlap;
        actq_image_cost(other, null_mut()) => Null;
    }
    assert_eq!(bytes.0, BYTES.0, "the image is as it was");
}

#[test]
fn a_step_during_polls_is_an_error() {
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let (observation, mut action) = (vec![0.5f32; obs], vec![0.0f32; act]);
    let (head, o, a) = (program.head(), observation.as_ptr(), action.as_mut_ptr());
    let mut saved = vec![0; 1 << 16];
    let mut len = 0;
    gives! {
        actq_saved_bytes(head, &mut len) => Ok;
        actq_begin(head, o, obs) => Ok;
        actq_poll(head, 1, a, act) => Budget;
        actq_step(head, o, obs, a, act) => Polling;
        actq_save(head, saved.as_mut_ptr(), len) => SavedBegun;
        actq_begin(head, o, obs) => Ok;
        actq_poll(head, u32::MAX, a, act) => Ok;
        actq_poll(head, u32::MAX, a, act) => Ok;
        actq_step(head, o, obs, a, act) => Ok;
        actq_begin(head, o, obs) => Ok;
        actq_reset(head) => Ok;
        actq_poll(head, u32::MAX, a, act) => NotBegun;
        actq_step(head, o, obs, a, act) => Ok;
    }
}

#[test]
fn damaged_images_and_infinite_values_are_errors() {
    let mut damaged = Box::new(Aligned(BYTES.0));
    let middle = damaged.0.len() / 2;
    damaged.0[middle] ^= 1;
    let mut program = Program::start();
    let (obs, act) = program.lengths();
    let (mut observation, mut action) = (vec![0.5f32; obs], vec![7.0f32; act]);
    observation[obs - 1] = f32::NAN;
    let (image, head) = (program.image(), program.head());
    gives! {
        actq_step(head, observation.as_ptr(), obs, action.as_mut_ptr(), act) => ObservationNotFinite;
        actq_set_input(image, c"velocity".as_ptr(), observation.as_ptr(), 1, action.as_mut_ptr(), act) => NoSuchPort;
        actq_set_input(image, null(), observation.as_ptr(), 1, action.as_mut_ptr(), act) => Null;
        actq_image_open(image, damaged.0.as_ptr(), damaged.0.len()) => ImageError Checksum;
        actq_image_open_checksummed(image, damaged.0.as_ptr(), damaged.0.len()) => ImageError Checksum;
        actq_image_open_checksummed(image, BYTES.0.as_ptr(), 4) => ImageError TooShort;
        actq_image_open(image, BYTES.0.as_ptr().wrapping_add(1), BYTES.0.len() - 1) => ImageError Misaligned;
        actq_image_open(image, BYTES.0.as_ptr(), 4) => ImageError TooShort;
    }
    assert!(action.iter().all(|value| *value == 7.0));
    // SAFETY: the pointers are valid.
    assert_eq!(unsafe { actq_image_open(image, BYTES.0.as_ptr(), BYTES.0.len()) }, OK);
}
