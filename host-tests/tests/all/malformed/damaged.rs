//! Damage: flipped bits, missing bytes, and memory that changes after the check.

use actq_bench::root;
use actq_kernels::image::header as h;
use actq_kernels::image::op;
use actq_kernels::{Head, Image, ImageError as E, StepError};

use super::draft::{Change, FIRST, FUNCTION, HUGE, LAYER_NORM, LSTM, NORMALIZE, OBS, OUTPUT, UNITS, VALID};
use crate::draft::Draft;

#[test]
fn the_undamaged_image_is_valid_and_four_kib() {
    let image = VALID.check().expect("the image is valid");
    assert!((4096..5120).contains(&image.bytes()), "{} bytes", image.bytes());
    let mut scratch = vec![!0; image.scratch_words()];
    let mut head = Head::new(image, &mut scratch).expect("the scratch memory has the image's size");
    head.self_test().expect("the self-test passes");
}

/// The kernels' own tests change this image at random. `ACTQ_BLESS=1` rewrites it.
#[test]
fn the_kernels_tests_use_this_image() {
    let path = root().join("kernels/tests/valid.actq");
    if std::env::var_os("ACTQ_BLESS").is_some() {
        std::fs::write(&path, VALID.bytes()).expect("the file can be written");
    }
    let there = std::fs::read(&path).expect("the file can be read");
    assert!(there == VALID.bytes(), "{} is outdated: run the test with ACTQ_BLESS=1", path.display());
}

#[test]
fn every_single_bit_flip_is_refused() {
    let mut draft = VALID.clone();
    for at in 0..draft.0.len() {
        for bit in 0..32 {
            draft.0[at] ^= 1 << bit;
            assert!(draft.check().is_err(), "bit {bit} of word {at}");
            draft.0[at] ^= 1 << bit;
        }
    }
    assert!(draft.check().is_ok());
}

#[test]
fn every_truncation_and_short_extension_is_refused() {
    let len = VALID.bytes().len();
    for fill in [0, !0, 0x5a5a_5a5a] {
        let mut draft = VALID.clone();
        draft.0.extend([fill; 16]);
        for n in (0..=len + 64).filter(|n| *n != len) {
            let expected = if n < 4 * h::WORDS { E::TooShort } else { E::Length };
            assert_eq!(Image::new_checked(&draft.bytes()[..n]).err(), Some(expected), "{n} bytes");
        }
        // The checksum does not match a header that claims the other length.
        for words in (h::WORDS..draft.0.len()).filter(|n| *n != len / 4) {
            let mut other = Draft(draft.0[..words].to_vec());
            other.set(h::W_BYTES, 4 * words as u32);
            assert_eq!(other.check().err(), Some(E::Checksum), "{words} words");
        }
    }
}

#[test]
fn a_misaligned_start_is_refused() {
    let len = VALID.bytes().len();
    let mut memory = Draft(vec![0; len / 4 + 1]);
    for shift in 1..4 {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut memory.0);
        bytes[shift..shift + len].copy_from_slice(VALID.bytes());
        assert_eq!(Image::new_checked(&memory.bytes()[shift..shift + len]).err(), Some(E::Misaligned), "{shift}");
    }
}

/// Flash that decays, or is rewritten under the head: content that no longer parses is an error, not a stale action.
#[test]
fn damage_after_the_check_is_an_error() {
    let cases: &[(&str, Change)] = &[
        ("an operation's code", |d| d.set_low(d.op(FUNCTION), 0)),
        ("a function's code", |d| d.set_low(d.op(FUNCTION), u32::from(op::FUNCTION) | 99 << 8)),
        ("a destination", |d| d.set_low(d.op(FUNCTION) + 1, 0xffff)),
        ("a source", |d| d.set_high(d.op(NORMALIZE) + 1, 0xffff)),
        ("a cell state", |d| d.set_high(d.op(LSTM) + 2, 0xffff)),
        ("constants", |d| d.set(d.op(NORMALIZE) + 3, HUGE)),
        ("constants of a norm", |d| d.set(d.op(LAYER_NORM) + 3, d.0.len() as u32)),
        ("a matrix", |d| d.set(d.op(FIRST) + 3, HUGE)),
        ("a matrix's rows", |d| d.set_low(d.data(FIRST), UNITS as u32 - 1)),
        ("a matrix's group", |d| d.set_low(d.data(FIRST) + 1, 7)),
        ("a matrix's blocks", |d| d.set(d.data(FIRST) + 3, HUGE)),
        ("biases", |d| d.set(d.op(FIRST) + 2, HUGE)),
        ("a width", |d| d.set_low(d.block(FIRST, 0), 5)),
        ("a block's rows", |d| d.set_high(d.block(FIRST, 0), UNITS as u32 + 1)),
        ("weights", |d| d.set(d.block(FIRST, 0) + 1, HUGE)),
        ("scales", |d| d.set(d.block(FIRST, 0) + 2, HUGE)),
        ("output steps", |d| d.set(d.offset(d.block(OUTPUT, 1) + 3), u32::MAX)),
        ("the observation's place", |d| d.set_low(h::W_OBS_OUT, 0xffff)),
        ("the output's place", |d| d.set_high(h::W_OBS_OUT, 0xffff)),
        ("the action's place", |d| d.set_low(h::W_ACTION_WORK, 0xffff)),
        ("the work area's place", |d| d.set_high(h::W_ACTION_WORK, 0xffff)),
    ];
    for (name, damage) in cases {
        let mut draft = VALID.clone();
        damage(&mut draft);
        let image = Image::unchecked(draft.bytes()).expect("the header is there");
        let mut scratch = vec![0; image.scratch_words()];
        let mut head = Head::new(image, &mut scratch).expect("the scratch memory has the image's size");
        assert_eq!(head.step(&[0.5; OBS]).err(), Some(StepError::Damaged), "{name}");
        // In pieces, too, and repeatedly.
        let in_pieces = head.begin(&[0.5; OBS]).and_then(|()| head.poll(u32::MAX).map(|_| ()));
        assert_eq!(in_pieces, Err(StepError::Damaged), "{name}");
    }
}
