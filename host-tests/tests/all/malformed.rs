//! Damaged images, and images with a correct checksum and impossible content: `Image::new_checked` must refuse all.
//! (`kernels/tests/mutants.rs` shows that accepted images run without a panic.)

mod around;
mod attention;
mod damaged;
mod draft;

use actq::graph::ops::Linear;
use actq::methods::Activations;
use actq_bench::networks::Builder;
use actq_kernels::ImageError as E;
use actq_kernels::image::{header as h, op};
use actq_kernels::layout::Width;
use anyhow::Result;

use crate::draft::Draft;
use draft::{
    ACT, CHUNK, FIRST, FUNCTION, HUGE, INPUT, LAYER_NORM, LSTM, NAN, NORMALIZE, OBS, OUTPUT, STATE, UNITS, VALID,
    refused, refused_of,
};

#[test]
fn impossible_headers_are_refused() {
    refused(&[
        ("wrong magic", E::Magic, |d| d.set(0, u32::from_le_bytes(*b"ACTP"))),
        ("a later version", E::Version, |d| d.set_low(h::W_VERSION, u32::from(h::VERSION) + 1)),
        ("a longer header", E::Version, |d| d.set_high(h::W_VERSION, 33)),
        ("a length one word off", E::Length, |d| d.set(h::W_BYTES, d.get(h::W_BYTES) + 4)),
        ("another layout stamp", E::Layout, |d| d.set(h::W_LAYOUT, d.get(h::W_LAYOUT) + 1)),
        ("an average of chunks of which two actions are executed", E::Playback, |d| d.set_high(h::W_MATRIX_COUNT, 1)),
        ("an average of more chunks than a chunk has actions", E::Playback, |d| {
            d.set_high(h::W_CHUNK, 1);
            d.set_high(h::W_MATRIX_COUNT, CHUNK as u32 + 1);
        }),
        ("an average and an overlap", E::Playback, |d| {
            d.set_high(h::W_CHUNK, 1);
            d.set_high(h::W_MATRIX_COUNT, 1);
            d.set_low(h::W_PLAYBACK, 1);
        }),
        ("an average without memory for it", E::Arena, |d| {
            d.set_high(h::W_CHUNK, 1);
            d.set_high(h::W_MATRIX_COUNT, 1);
        }),
        ("an overlap where nothing is left", E::Playback, |d| d.set_low(h::W_PLAYBACK, 1)),
        ("an overlap without memory for it", E::Arena, |d| {
            d.set_high(h::W_CHUNK, 1);
            d.set_low(h::W_PLAYBACK, 1);
        }),
        ("a deadline before the last action", E::Playback, |d| d.set_high(h::W_PLAYBACK, 1)),
        ("operations of denoising steps in another kind", E::Denoising, |d| d.set(h::W_DENOISING, 1)),
        ("reserved byte beside the kind", E::Reserved, |d| d.set(h::W_KIND, d.get(h::W_KIND) | 2 << 8)),
        ("an unknown contract flag", E::Reserved, |d| d.set_high(h::W_WORK_FLAGS, 0x41f)),
        ("an unknown kind", E::Kind, |d| d.set(h::W_KIND, d.get(h::W_KIND) & !0xff | 4)),
        ("execute above chunk", E::Chunk, |d| d.set_high(h::W_CHUNK, CHUNK as u32 + 1)),
        ("execute 0", E::Chunk, |d| d.set_high(h::W_CHUNK, 0)),
        ("chunk 0", E::Chunk, |d| d.set(h::W_CHUNK, 0)),
        ("a chunk in kind step", E::Chunk, |d| d.set(h::W_KIND, d.get(h::W_KIND) - 1)),
        ("no observation", E::Shape, |d| d.set_low(h::W_SIZES, 0)),
        ("no action", E::Shape, |d| d.set_high(h::W_SIZES, 0)),
        ("scratch too small", E::Arena, |d| d.set(h::W_SCRATCH, d.get(h::W_SCRATCH) - 1)),
        ("state outside", E::Arena, |d| d.set_high(h::W_STATE, 0xffff)),
        ("observation outside", E::Arena, |d| d.set_low(h::W_OBS_OUT, 0xffff)),
        ("output outside", E::Unwritten, |d| d.set_high(h::W_OBS_OUT, 0xffff)),
        ("action outside", E::Arena, |d| d.set_low(h::W_ACTION_WORK, 0xffff)),
        ("work area outside", E::Arena, |d| d.set_high(h::W_ACTION_WORK, 0xffff)),
        ("output over action", E::Unwritten, |d| d.set_high(h::W_OBS_OUT, d.low(h::W_ACTION_WORK) - 1)),
        ("output over observation", E::Arena, |d| d.set_high(h::W_OBS_OUT, d.low(h::W_OBS_OUT))),
        ("action over observation", E::Arena, |d| d.set_low(h::W_ACTION_WORK, d.low(h::W_OBS_OUT) + 1)),
        ("rate 0", E::Constant, |d| d.set_f32(h::W_RATE, 0.0)),
        ("rate negative", E::Constant, |d| d.set_f32(h::W_RATE, -50.0)),
        ("rate NaN", E::Constant, |d| d.set_f32(h::W_RATE, NAN)),
        ("rate infinite", E::Constant, |d| d.set_f32(h::W_RATE, f32::INFINITY)),
        ("name outside", E::Section, |d| d.set(h::W_NAME, d.0.len() as u32)),
        ("name in the header", E::Section, |d| d.set(h::W_NAME, 20)),
        ("name at a huge offset", E::Section, |d| d.set(h::W_NAME, HUGE)),
        ("name not UTF-8", E::Name, |d| d.set(d.offset(h::W_NAME), 0xc3c3_c3c3)),
        ("name cut inside a character", E::Name, |d| {
            // The name has 9 bytes; the ninth is the first of two of a character.
            d.set(d.offset(h::W_NAME) + 2, 0xa4c3);
        }),
        ("self-test of no steps", E::SelfTest, |d| d.set_low(h::W_STEPS_NAME, 0)),
        ("self-test outside", E::Section, |d| d.set(h::W_SELF_TEST, d.0.len() as u32 - 1)),
        ("self-test at a huge offset", E::Section, |d| d.set(h::W_SELF_TEST, HUGE)),
        ("self-test of too many steps", E::Section, |d| d.set_low(h::W_STEPS_NAME, 0xffff)),
        ("self-test NaN", E::Constant, |d| d.set_f32(d.offset(h::W_SELF_TEST) + OBS, NAN)),
        ("lengths whose product wraps a 32-bit usize", E::Arena, |d| {
            d.set(h::W_SIZES, 0xffff | 32767 << 16);
            d.set(h::W_CHUNK, 1 | 1 << 16);
            d.set(h::W_SCRATCH, 1 << 18);
            d.set(h::W_STATE, 0);
            d.set(h::W_OBS_OUT, 2 * 32767);
            d.set(h::W_ACTION_WORK, 32767 | d.high(h::W_ACTION_WORK) << 16);
            d.set(h::W_WORK_FLAGS, 0);
            d.set_low(h::W_STEPS_NAME, 43692);
        }),
        ("a contract of no arrays at a huge offset", E::Section, |d| {
            d.set_high(h::W_WORK_FLAGS, 0);
            d.set(h::W_CONTRACT, HUGE);
        }),
        ("a contract of no arrays at the last offset", E::Section, |d| {
            d.set_high(h::W_WORK_FLAGS, 0);
            d.set(h::W_CONTRACT, u32::MAX);
        }),
        ("more scratch than anything needs", E::Arena, |d| d.set(h::W_SCRATCH, d.get(h::W_SCRATCH) + 1)),
        ("all the scratch there is", E::Arena, |d| d.set(h::W_SCRATCH, u32::MAX)),
        ("scratch beyond u16", E::Arena, |d| {
            d.set_low(h::W_WORK_FLAGS, 0xffff);
            d.set(h::W_SCRATCH, d.high(h::W_ACTION_WORK) + 0xffff);
        }),
        ("a gap before the action", E::Arena, |d| {
            d.set(h::W_ACTION_WORK, d.get(h::W_ACTION_WORK) + 0x1_0001);
            d.set(h::W_SCRATCH, d.get(h::W_SCRATCH) + 1);
        }),
        ("a name with an escape character", E::Name, |d| d.set_low(d.offset(h::W_NAME), 0x5b1b)),
        ("a name with a C1 control character", E::Name, |d| d.set_low(d.offset(h::W_NAME), 0x9bc2)),
    ]);
}

#[test]
fn impossible_contracts_are_refused() {
    // Arrays are in the order of their flags: scale, offset, low, high, max_step.
    fn array(d: &Draft, which: usize) -> usize {
        d.offset(h::W_CONTRACT) + which * ACT
    }
    /// Flags of a contract that binarises, and memory of the values that are on.
    fn binarised(d: &mut Draft, flags: u32) {
        d.set_high(h::W_WORK_FLAGS, flags);
        d.set_high(h::W_ACTION_WORK, d.high(h::W_ACTION_WORK) + ACT as u32);
        d.set(h::W_SCRATCH, d.get(h::W_SCRATCH) + ACT as u32);
    }
    refused(&[
        ("contract outside", E::Section, |d| d.set(h::W_CONTRACT, d.0.len() as u32)),
        ("contract in the header", E::Section, |d| d.set(h::W_CONTRACT, 0)),
        ("contract at a huge offset", E::Section, |d| d.set(h::W_CONTRACT, HUGE)),
        ("scale NaN", E::Constant, |d| d.set_f32(array(d, 0), NAN)),
        ("offset infinite", E::Constant, |d| d.set_f32(array(d, 1) + 1, f32::INFINITY)),
        ("low NaN", E::Constant, |d| d.set_f32(array(d, 2) + 3, NAN)),
        ("high infinite", E::Constant, |d| d.set_f32(array(d, 3), f32::INFINITY)),
        ("limits reversed", E::Limits, |d| d.set_f32(array(d, 3) + 3, -1.5)),
        ("max_step negative", E::Constant, |d| d.set_f32(array(d, 4) + 3, -0.25)),
        ("max_step NaN", E::Constant, |d| d.set_f32(array(d, 4), NAN)),
        ("thresholds without values", E::Binarise, |d| binarised(d, 0xdf)),
        ("values without thresholds", E::Binarise, |d| d.set_high(h::W_WORK_FLAGS, 0x31f)),
        // max_step's array serves as that of smoothing.
        ("smoothing 0", E::Smoothing, |d| {
            d.set_high(h::W_WORK_FLAGS, 0x2f);
            d.set_f32(array(d, 4) + 1, 0.0);
        }),
        ("smoothing above 1", E::Smoothing, |d| {
            d.set_high(h::W_WORK_FLAGS, 0x2f);
            d.set_f32(array(d, 4) + 1, 1.5);
        }),
        // The four arrays serve as those that binarise; the thresholds are reversed, as they take the limits' array.
        ("thresholds reversed", E::Binarise, |d| {
            binarised(d, 0x3c1);
            d.set_f32(array(d, 2), 0.5);
        }),
    ]);
}

#[test]
fn impossible_operations_are_refused() {
    refused(&[
        ("operations outside", E::Section, |d| d.set(h::W_OPS, d.0.len() as u32)),
        ("operations in the header", E::Section, |d| d.set(h::W_OPS, 4)),
        ("operations at a huge offset", E::Section, |d| d.set(h::W_OPS, HUGE)),
        ("too many operations", E::Op, |d| d.set_high(h::W_KIND, 0xffff)),
        ("operation code 0", E::Op, |d| d.set(d.op(FUNCTION), 0)),
        ("operation code 24", E::Op, |d| d.set(d.op(FUNCTION), 24)),
        ("an unknown function", E::Op, |d| d.set_low(d.op(FUNCTION), u32::from(op::FUNCTION) | 12 << 8)),
        ("detail 4 in linear", E::Reserved, |d| d.set_low(d.op(FIRST), u32::from(op::LINEAR) | 4 << 8)),
        ("an input in place that must be padded", E::Arena, |d| d.map_low(d.op(FIRST), |half| half | 2 << 8)),
        ("an input in place for several blocks", E::Arena, |d| d.map_low(d.op(OUTPUT), |half| half | 2 << 8)),
        ("detail 1 in layer norm", E::Reserved, |d| d.set_low(d.op(LAYER_NORM), u32::from(op::LAYER_NORM) | 1 << 8)),
        ("an operation of no length", E::Shape, |d| d.set_high(d.op(FUNCTION), 0)),
        ("destination outside", E::Unwritten, |d| d.set_low(d.op(FUNCTION) + 1, 0xffff)),
        ("source outside", E::Unwritten, |d| d.set_high(d.op(NORMALIZE) + 1, 0xffff)),
        ("cell state outside", E::Unwritten, |d| d.set_high(d.op(LSTM) + 2, 0xffff)),
        ("source over destination", E::Overlap, |d| d.set_low(d.op(NORMALIZE) + 1, d.high(d.op(NORMALIZE) + 1))),
        ("gates over the hidden state", E::Overlap, |d| d.set_low(d.op(LSTM) + 1, d.high(d.op(LSTM) + 1))),
        ("gates over the cell state", E::Overlap, |d| d.set_high(d.op(LSTM) + 2, d.high(d.op(LSTM) + 1) + 1)),
        ("cell state over the hidden state", E::Overlap, |d| d.set_high(d.op(LSTM) + 2, d.low(d.op(LSTM) + 1) + 1)),
        ("work area too small", E::Arena, |d| d.set_low(h::W_WORK_FLAGS, 16)),
        ("work area over a source", E::Arena, |d| d.set_high(h::W_ACTION_WORK, d.high(d.op(FIRST) + 1))),
        ("work area over a destination", E::Arena, |d| d.set_high(h::W_ACTION_WORK, d.low(d.op(FIRST) + 1) + 23)),
        ("normalization outside", E::Section, |d| d.set(d.op(NORMALIZE) + 3, d.0.len() as u32 - 1)),
        ("normalization at a huge offset", E::Section, |d| d.set(d.op(NORMALIZE) + 3, HUGE)),
        ("normalization mean NaN", E::Constant, |d| d.set_f32(d.data(NORMALIZE) + 2, NAN)),
        ("clip 0", E::Constant, |d| d.set_f32(d.data(NORMALIZE) + 1, 0.0)),
        ("clip NaN", E::Constant, |d| d.set_f32(d.data(NORMALIZE) + 1, NAN)),
        ("clip before negative", E::Constant, |d| d.set_f32(d.data(NORMALIZE), -1.0)),
        ("layer norm outside", E::Section, |d| d.set(d.op(LAYER_NORM) + 3, d.0.len() as u32)),
        ("layer norm at a huge offset", E::Section, |d| d.set(d.op(LAYER_NORM) + 3, u32::MAX)),
        ("eps 0", E::Constant, |d| d.set_f32(d.data(LAYER_NORM), 0.0)),
        ("eps infinite", E::Constant, |d| d.set_f32(d.data(LAYER_NORM), f32::INFINITY)),
        ("layer norm weight NaN", E::Constant, |d| d.set_f32(d.data(LAYER_NORM) + 1, NAN)),
        ("layer norm bias infinite", E::Constant, |d| d.set_f32(d.data(LAYER_NORM) + 48, f32::INFINITY)),
    ]);
}

#[test]
fn impossible_matrices_are_refused() {
    fn scales(d: &Draft) -> usize {
        d.offset(d.block(OUTPUT, 0) + 2)
    }
    fn steps(d: &Draft) -> usize {
        d.offset(d.block(OUTPUT, 1) + 3)
    }
    refused(&[
        ("matrix record outside", E::Matrix, |d| d.set(d.op(FIRST) + 3, d.0.len() as u32 - 3)),
        ("matrix record at a huge offset", E::Matrix, |d| d.set(d.op(FIRST) + 3, HUGE)),
        ("rows 0", E::Shape, |d| d.set_low(d.data(FIRST), 0)),
        ("rows 4097", E::Shape, |d| d.set_low(d.data(FIRST), 4097)),
        ("columns 0", E::Shape, |d| d.set_high(d.data(FIRST), 0)),
        ("matrix record inside another", E::Matrix, |d| d.set(d.op(FIRST) + 3, d.get(d.op(FIRST) + 3) + 1)),
        ("a matrix after the last", E::Matrix, |d| d.set_low(h::W_MATRIX_COUNT, 3)),
        ("matrix records outside", E::Section, |d| d.set(h::W_MATRICES, d.0.len() as u32 - 3)),
        ("block records outside", E::Section, |d| d.set(d.data(FIRST) + 3, d.0.len() as u32 - 3)),
        ("more rows than the destination", E::Shape, |d| d.set_high(d.op(FIRST), UNITS as u32 - 1)),
        ("group 7", E::Group, |d| d.set_low(d.data(FIRST) + 1, 7)),
        ("group 256", E::Group, |d| d.set_low(d.data(FIRST) + 1, 256)),
        ("x_max 0", E::Constant, |d| d.set_high(d.data(FIRST) + 1, 0)),
        ("x_max 32768", E::Constant, |d| d.set_high(d.data(FIRST) + 1, 32768)),
        ("reserved half of the matrix record", E::Reserved, |d| d.set_high(d.data(FIRST) + 2, 1)),
        ("too many blocks", E::Section, |d| d.set_low(d.data(FIRST) + 2, 0xffff)),
        ("bias outside", E::Section, |d| d.set(d.op(FIRST) + 2, d.0.len() as u32)),
        ("bias in the header", E::Section, |d| d.set(d.op(FIRST) + 2, 1)),
        ("bias at a huge offset", E::Section, |d| d.set(d.op(FIRST) + 2, HUGE)),
        ("bias NaN", E::Constant, |d| d.set_f32(d.offset(d.op(FIRST) + 2), NAN)),
        ("width 5", E::Width, |d| d.set_low(d.block(FIRST, 0), 5)),
        ("width 0", E::Width, |d| d.set_low(d.block(FIRST, 0), 0)),
        ("unknown lanes", E::Lanes, |d| d.set_low(d.block(FIRST, 0), 4 | 4 << 8)),
        ("a scalar layout for int16 activations", E::Lanes, |d| d.set_low(d.block(OUTPUT, 0), 2 | 2 << 8)),
        ("a layout for Helium for int16 activations", E::Lanes, |d| d.set_low(d.block(OUTPUT, 0), 2 | 3 << 8)),
        ("single lanes for int8 activations", E::Lanes, |d| d.set_low(d.block(FIRST, 0), 4)),
        ("paired lanes for int16 activations", E::Lanes, |d| d.set_low(d.block(OUTPUT, 0), 2 | 1 << 8)),
        ("a block of no rows", E::Shape, |d| d.set_high(d.block(FIRST, 0), 0)),
        ("a block with more rows than the matrix", E::Shape, |d| d.set_high(d.block(FIRST, 0), UNITS as u32 + 1)),
        ("weights outside", E::Section, |d| d.set(d.block(FIRST, 0) + 1, d.0.len() as u32 - 1)),
        ("weights in the header", E::Section, |d| d.set(d.block(FIRST, 0) + 1, 31)),
        ("weights at a huge offset", E::Section, |d| d.set(d.block(FIRST, 0) + 1, HUGE)),
        ("row scales outside", E::Section, |d| d.set(d.block(FIRST, 0) + 2, d.0.len() as u32)),
        ("row scales at a huge offset", E::Section, |d| d.set(d.block(FIRST, 0) + 2, HUGE)),
        ("row scale negative", E::Constant, |d| d.set_low(scales(d), 0xbf80)),
        ("row scale minus 0", E::Constant, |d| d.set_low(scales(d), 0x8000)),
        ("row scale NaN", E::Constant, |d| d.set_high(scales(d), 0x7fc0)),
        ("row scale infinite", E::Constant, |d| d.set_high(scales(d) + 1, 0x7f80)),
        ("steps outside the image", E::Section, |d| d.set(d.block(OUTPUT, 1) + 3, d.0.len() as u32 - 1)),
        ("steps in the header", E::Section, |d| d.set(d.block(OUTPUT, 1) + 3, 8)),
        ("steps at a huge offset", E::Section, |d| d.set(d.block(OUTPUT, 1) + 3, HUGE)),
        ("steps beyond the rows", E::Index, |d| d.set_low(steps(d), (CHUNK * ACT) as u32)),
        ("steps beyond all rows", E::Index, |d| d.set(steps(d), u32::MAX)),
        ("a step of 0", E::Index, |d| d.set(steps(d), d.get(steps(d)) & 0xff)),
        ("steps to the outputs of another block", E::Index, |d| d.set_low(steps(d), 0)),
        ("blocks with more rows than the matrix", E::Index, |d| {
            // Four rows each: one has no output left.
            for i in 0..2 {
                d.set(d.block(OUTPUT, i) + 3, 0);
            }
            d.set_low(d.data(OUTPUT), 7);
        }),
        ("row scales away from their weights", E::Section, |d| d.map_low(d.block(FIRST, 0) + 2, |at| at + 1)),
        ("steps away from its scales", E::Section, |d| {
            d.set(d.block(OUTPUT, 0) + 3, d.get(d.block(OUTPUT, 1) + 3));
        }),
        ("two matrices on the same weights", E::Section, |d| {
            for word in 1..4 {
                d.set(d.block(STATE, 0) + word, d.get(d.block(INPUT, 0) + word));
            }
        }),
        ("biases of an earlier operation, and after them", E::Section, |d| {
            d.set(d.op(INPUT) + 2, d.get(d.op(FIRST) + 2))
        }),
        ("biases in the weights", E::Section, |d| d.set(d.op(FIRST) + 2, d.get(d.block(FIRST, 0) + 1))),
        ("int32 overflow possible", E::Overflow, |d| {
            // The 8-bit rows have 24 columns; with the largest group scale they exceed 2^31 / 32767.
            let quad = d.offset(d.block(OUTPUT, 1) + 1);
            d.set(quad + 4 * UNITS / 4, u32::MAX);
            d.set_high(d.data(OUTPUT) + 1, 32767);
        }),
    ]);
}

#[test]
fn int32_sums_are_allowed_to_the_limit() {
    // One row of the 8-bit block decides; x_max may be as large as its sum allows, and no larger.
    let mut draft = VALID.clone();
    let x_max = draft.data(OUTPUT) + 1;
    let quad = draft.offset(draft.block(OUTPUT, 1) + 1);
    for at in 0..UNITS {
        draft.set(quad + at, 0x7f7f_7f7f);
    }
    draft.set(quad + UNITS, u32::MAX);
    let largest = i32::MAX as u32 / (24 * 127 * 255);
    for (value, expected) in [(largest, None), (largest + 1, Some(E::Overflow))] {
        draft.set_high(x_max, value);
        draft.seal();
        assert_eq!(draft.check().err(), expected, "x_max {value}");
    }
}

#[test]
fn only_the_contract_may_write_the_last_action() {
    // The last action bounds the next one; a stray write there would move the action out of its limits.
    refused(&[
        ("work area over the action", E::Arena, |d| d.set_low(h::W_ACTION_WORK, d.high(h::W_ACTION_WORK) + 1)),
        ("destination over the action", E::Unwritten, |d| d.set_low(d.op(FUNCTION) + 1, d.low(h::W_ACTION_WORK))),
        ("cell state over the action", E::Unwritten, |d| d.set_high(d.op(LSTM) + 2, d.low(h::W_ACTION_WORK))),
    ]);
}

#[test]
fn operations_read_only_values_of_their_step() {
    // Otherwise an action would depend on the step before, or on the backend that prepared the activations.
    refused(&[
        ("a source in the work area", E::Unwritten, |d| d.set_high(d.op(NORMALIZE) + 1, d.high(h::W_ACTION_WORK))),
        ("a source in the last action", E::Unwritten, |d| d.set_high(d.op(NORMALIZE) + 1, d.low(h::W_ACTION_WORK))),
        ("a source that is written later", E::Unwritten, |d| d.set_high(d.op(FIRST) + 1, d.low(d.op(INPUT) + 1))),
        ("a function of what is written later", E::Unwritten, |d| {
            d.set_low(d.op(FUNCTION) + 1, d.low(d.op(INPUT) + 1))
        }),
        ("a sum with what is written later", E::Unwritten, |d| {
            d.set_low(d.op(FIRST), u32::from(op::LINEAR) | 1 << 8);
        }),
        ("a destination after a gap", E::Arena, |d| d.map_low(d.op(NORMALIZE) + 1, |at| at + 1)),
        ("an output that is not written", E::Unwritten, |d| d.set_high(h::W_OBS_OUT, d.low(h::W_ACTION_WORK) - 1)),
    ]);
}

#[test]
fn the_state_shares_no_memory_with_a_step() {
    refused(&[
        ("state over the observation", E::Arena, |d| d.set_low(h::W_STATE, d.low(h::W_OBS_OUT))),
        ("state over the action", E::Arena, |d| d.set_low(h::W_STATE, d.low(h::W_ACTION_WORK))),
        ("state over the work area", E::Arena, |d| {
            d.set_low(h::W_STATE, d.high(h::W_ACTION_WORK));
            d.set_high(h::W_STATE, 1);
        }),
    ]);
}

#[test]
fn a_network_without_operations_is_refused() {
    // Its output would be the scratch memory's old content.
    refused(&[("no operations", E::Shape, |d| d.set_high(h::W_KIND, 0))]);
}

#[test]
fn unused_fields_of_an_operation_are_zero() {
    // Otherwise a later version could not give them a meaning.
    refused(&[
        ("source of a function", E::Reserved, |d| d.set_high(d.op(FUNCTION) + 1, 1)),
        ("constants of a function", E::Reserved, |d| d.set(d.op(FUNCTION) + 3, 32)),
        ("source length of a normalization", E::Reserved, |d| d.set_low(d.op(NORMALIZE) + 2, 1)),
        ("source of a layer norm", E::Reserved, |d| d.set_high(d.op(LAYER_NORM) + 1, 1)),
        ("constants of a cell", E::Reserved, |d| d.set(d.op(LSTM) + 3, 32)),
    ]);
}

fn in_place() -> Result<Vec<u8>> {
    let (mut builder, mut value) = (Builder::new(OBS), 0);
    for (rows, cols) in [(64, OBS), (32, 64), (ACT, 32)] {
        let matrix = builder.matrix(rows, cols, Activations::Int8, &vec![Some(Width::W2); rows], 0)?;
        let bias = builder.values(rows);
        value = builder.node(Linear { matrix, bias }, &[value])?;
    }
    builder.image("in-place")
}

/// Layers of which the second prepares its input in place and writes over the rest of it.
#[test]
fn impossible_inputs_in_place_are_refused() {
    const SECOND: (u8, usize) = (op::LINEAR, 1);
    let valid = Draft::of(&in_place().expect("the network fits the format"));
    let op = valid.op(SECOND);
    let (detail, dst, src) = (valid.low(op) >> 8, valid.low(op + 1), valid.high(op + 1));
    assert_eq!((detail, dst - src), (2, 41), "1 + 64 / 8 * 5 words are prepared");
    refused_of(
        &valid,
        &[
            ("an output over the prepared input", E::Arena, |d| d.map_low(d.op(SECOND) + 1, |dst| dst - 20)),
            ("an output before its input", E::Overlap, |d| d.map_low(d.op(SECOND) + 1, |dst| dst - 42)),
            ("an input apart in a work area for another", E::Arena, |d| d.map_low(d.op(SECOND), |half| half & 0xff)),
            ("a sum over its input", E::Overlap, |d| d.map_low(d.op(SECOND), |half| half | 3 << 8)),
            ("an output without biases over its input", E::Overlap, |d| d.set(d.op(SECOND) + 2, 0)),
        ],
    );
}
