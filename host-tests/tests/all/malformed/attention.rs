//! Images with impossible attention.

use actq_kernels::ImageError as E;
use actq_kernels::image::{Cache, header as h, op};
use actq_testkit::Random;

use super::draft::{Case, NAN, refused_of};
use crate::attention::{Attention, Prefixed};
use crate::draft::Draft;

const KEEP: (u8, usize) = (op::KEEP, 0);
const ATTEND: (u8, usize) = (op::ATTEND, 0);
const ROTARY: (u8, usize) = (op::ROTARY, 0);
/// The third region of the record of an operation.
const THIRD: usize = 2;

/// Two heads share those of the cache; three queries see four tokens.
fn whole() -> Attention {
    let cache = Cache { heads: 2, dim: 6, slots: 4, own: 0 };
    Attention { heads: 4, cache, tokens: 3, is_ring: false, is_causal: true, is_rotated: false, factor: 0.4 }
}

fn ring() -> Attention {
    Attention { tokens: 1, is_ring: true, is_causal: false, ..whole() }
}

fn draft(attention: Attention) -> Draft {
    let draft = Draft(attention.image());
    assert!(draft.check().is_ok());
    draft
}

/// Cases of every attention.
const BOTH: &[Case] = &[
    ("a cache without heads", E::Shape, |d| d.set_low(d.data(KEEP), 0)),
    ("keys without columns", E::Shape, |d| d.set_high(d.data(KEEP), 0)),
    ("a cache without slots", E::Shape, |d| d.set_low(d.data(KEEP) + 1, 0)),
    ("more columns than fit int32", E::Overflow, |d| d.set_high(d.data(KEEP), 513)),
    ("more slots than fit int32", E::Overflow, |d| d.set_low(d.data(KEEP) + 1, 513)),
    ("the largest sizes", E::Overflow, |d| {
        d.set(d.data(KEEP), u32::MAX);
        d.set(d.data(KEEP) + 1, 0xffff);
    }),
    ("more heads than the cache", E::Shape, |d| d.set_low(d.data(KEEP), 0xffff)),
    ("a cache one word longer", E::Shape, |d| d.map_high(d.op(KEEP), |len| len + 1)),
    ("a detail of keep", E::Reserved, |d| d.map_low(d.op(KEEP), |half| half | 1 << 8)),
    ("a bias of keep", E::Reserved, |d| d.set_low(d.op(KEEP) + THIRD, 1)),
    ("keys over values", E::Overlap, |d| d.set_high(d.op(KEEP) + THIRD, d.high(d.op(KEEP) + 1))),
    ("values outside", E::Unwritten, |d| d.set_high(d.op(KEEP) + THIRD, 0xffff)),
    ("keys outside", E::Unwritten, |d| d.set_high(d.op(KEEP) + 1, 0xffff)),
    ("sizes of keep outside", E::Section, |d| d.set(d.op(KEEP) + 3, d.0.len() as u32 - 1)),
    ("sizes of keep in the header", E::Section, |d| d.set(d.op(KEEP) + 3, 20)),
    ("heads that the cache's do not divide", E::Shape, |d| d.set_low(d.data(ATTEND), 3)),
    ("no heads", E::Shape, |d| d.set_low(d.data(ATTEND), 0)),
    ("fewer heads than the cache", E::Shape, |d| d.set_low(d.data(ATTEND), 1)),
    ("queries without columns", E::Shape, |d| d.set_low(d.data(ATTEND) + 1, 0)),
    ("queries of more columns than fit int32", E::Overflow, |d| d.set_low(d.data(ATTEND) + 1, 513)),
    ("part of a query", E::Shape, |d| d.set_low(d.data(ATTEND) + 1, 5)),
    ("tokens after no prefix", E::Overlap, |d| d.map_low(d.data(ATTEND) + 2, |flags| flags | 3 << 1)),
    ("more tokens than slots after a prefix", E::Shape, |d| d.set_low(d.data(ATTEND) + 2, 0xffff)),
    ("a reserved half of attend", E::Reserved, |d| d.set_high(d.data(ATTEND) + 2, 1)),
    ("a factor of 0", E::Constant, |d| d.set_f32(d.data(ATTEND) + 3, 0.0)),
    ("a negative factor", E::Constant, |d| d.set_f32(d.data(ATTEND) + 3, -1.0)),
    ("a factor NaN", E::Constant, |d| d.set_f32(d.data(ATTEND) + 3, NAN)),
    ("an infinite factor", E::Constant, |d| d.set_f32(d.data(ATTEND) + 3, f32::INFINITY)),
    ("outputs over queries", E::Overlap, |d| d.set_low(d.op(ATTEND) + 1, d.high(d.op(ATTEND) + 1))),
    ("a cache over the outputs", E::Overlap, |d| d.set_high(d.op(ATTEND) + THIRD, d.low(d.op(ATTEND) + 1))),
    ("a cache outside", E::Unwritten, |d| d.set_high(d.op(ATTEND) + THIRD, 0xffff)),
    ("sizes of attend outside", E::Section, |d| d.set(d.op(ATTEND) + 3, d.0.len() as u32 - 3)),
    ("a work area one word too short", E::Arena, |d| {
        d.set_low(h::W_WORK_FLAGS, d.low(h::W_WORK_FLAGS) - 1);
        d.set(h::W_SCRATCH, d.get(h::W_SCRATCH) - 1);
    }),
];

#[test]
fn impossible_attentions_are_refused() {
    for attention in [whole(), ring()] {
        refused_of(&draft(attention), BOTH);
    }
    refused_of(
        &draft(whole()),
        &[
            ("a ring that no reset clears", E::Unwritten, |d| d.set_high(d.data(KEEP) + 1, 1)),
            ("more causal queries than slots", E::Shape, |d| d.set_high(d.data(ATTEND) + 1, 2)),
            ("a longer cache than was written", E::Overlap, |d| d.set_high(d.data(ATTEND) + 1, 8)),
            ("own tokens in no prefix", E::Overlap, |d| d.set_high(d.data(KEEP) + 1, 2)),
        ],
    );
    refused_of(
        &draft(ring()),
        &[
            ("a ring that takes all slots at a time", E::Overlap, |d| d.set_high(d.data(KEEP) + 1, 0)),
            ("a ring outside the state", E::Unwritten, |d| d.set_high(h::W_STATE, d.high(h::W_STATE) - 1)),
            ("a ring after a prefix", E::Reserved, |d| d.map_high(d.data(KEEP) + 1, |flags| flags | 2)),
        ],
    );
}

#[test]
fn impossible_rotary_positions_are_refused() {
    refused_of(
        &draft(Attention { is_rotated: true, ..whole() }),
        &[
            ("positions of no heads", E::Shape, |d| d.set_low(d.data(ROTARY), 0)),
            ("positions of heads without columns", E::Shape, |d| d.set_high(d.data(ROTARY), 0)),
            ("positions of an odd column", E::Shape, |d| d.set_high(d.data(ROTARY), 3)),
            ("positions of part of a token", E::Shape, |d| d.set_low(d.data(ROTARY), 5)),
            ("the largest sizes of positions", E::Shape, |d| d.set(d.data(ROTARY), u32::MAX)),
            ("a sine NaN", E::Constant, |d| d.set_f32(d.data(ROTARY) + 4, NAN)),
            ("an infinite cosine", E::Constant, |d| d.set_f32(d.data(ROTARY) + 1, f32::INFINITY)),
            ("angles outside", E::Section, |d| d.set(d.op(ROTARY) + 3, d.0.len() as u32)),
            ("a source of positions", E::Reserved, |d| d.set_high(d.op(ROTARY) + 1, 1)),
            ("a third region of positions", E::Reserved, |d| d.set_high(d.op(ROTARY) + THIRD, 1)),
            ("a detail of rotary", E::Reserved, |d| d.map_low(d.op(ROTARY), |half| half | 1 << 8)),
        ],
    );
}

/// The first operation that writes own tokens after a prefix.
const FIRST_KEEP: (u8, usize) = (op::KEEP, 0);
/// The first attention that reads a prefix, and the second.
const FIRST: (u8, usize) = (op::ATTEND, 0);
const SECOND: (u8, usize) = (op::ATTEND, 1);

#[test]
fn impossible_prefixes_are_refused() {
    let cache = Cache { heads: 2, dim: 6, slots: 4, own: 0 };
    let of = |caches: [Cache; 2]| {
        let caches = caches.to_vec();
        let draft = Draft(Prefixed { heads: 4, caches, tokens: 2, is_causal: false, factor: 0.4 }.image());
        assert!(draft.check().is_ok());
        draft
    };
    // With three tokens of its own in one of them.
    let own = Cache { slots: 7, own: 3, ..cache };
    refused_of(
        &of([own, cache]),
        &[
            ("own tokens that are not read", E::Unwritten, |d| d.set_low(d.data(FIRST) + 2, 0)),
            ("fewer own tokens than are written", E::Unwritten, |d| d.set_low(d.data(FIRST) + 2, 2 << 1)),
            ("more causal queries than own tokens", E::Shape, |d| d.set_low(d.data(FIRST) + 2, 1 | 1 << 1)),
            ("own tokens in all slots", E::Shape, |d| d.set_high(d.data(FIRST_KEEP) + 1, 7 << 1)),
            ("own tokens of other slots", E::Unwritten, |d| {
                d.set_low(d.data(FIRST_KEEP) + 1, 8);
                d.set_high(d.op(FIRST_KEEP), Cache { heads: 2, dim: 6, slots: 8, own: 3 }.words() as u32);
            }),
            ("own tokens in a later cache", E::Overlap, |d| d.map_low(d.op(FIRST_KEEP) + 1, |at| at + 1)),
            ("keys in the prefix", E::Overlap, |d| d.set_high(d.op(FIRST_KEEP) + 1, 0)),
        ],
    );
    refused_of(
        &of([cache, own]),
        &[("own tokens in a cache of the prefix alone", E::Overlap, |d| d.set_low(d.op(FIRST_KEEP) + 1, 0))],
    );
    refused_of(
        &of([cache, Cache { slots: 3, ..cache }]),
        &[
            ("a cache that the first attention leaves out", E::Overlap, |d| {
                d.map_high(d.op(FIRST) + THIRD, |at| at + 1)
            }),
            ("a cache read twice", E::Overlap, |d| d.set_high(d.op(SECOND) + THIRD, d.high(d.op(FIRST) + THIRD))),
            ("caches in another order", E::Overlap, |d| d.set_high(d.op(FIRST) + THIRD, d.high(d.op(SECOND) + THIRD))),
            ("a gap between caches", E::Overlap, |d| d.map_high(d.op(SECOND) + THIRD, |at| at + 1)),
            ("a longer cache than its place", E::Overlap, |d| d.map_high(d.data(FIRST) + 1, |slots| slots + 4)),
            ("a last cache that ends after the prefix", E::Arena, |d| {
                d.map_high(d.data(SECOND) + 1, |slots| slots - 1)
            }),
            ("a last cache that ends before the observation", E::Arena, |d| {
                d.map_high(d.data(SECOND) + 1, |slots| slots + 1);
            }),
            ("own tokens that are not written", E::Unwritten, |d| d.set_low(d.data(FIRST) + 2, 1 << 1)),
            ("queries in the prefix", E::Overlap, |d| d.set_high(d.op(FIRST) + 1, 1)),
            ("outputs in the prefix", E::Overlap, |d| d.set_low(d.op(SECOND) + 1, 1)),
            ("a state in the prefix", E::Overlap, |d| d.set_high(h::W_STATE, 1)),
            ("an observation in the state", E::Arena, |d| d.set_high(h::W_STATE, d.low(h::W_OBS_OUT) + 1)),
        ],
    );
}

#[test]
fn every_drawn_attention_is_accepted() {
    let mut random = Random::new(8);
    for _ in 0..200 {
        draft(Attention::draw(&mut random));
        assert!(Draft(Prefixed::draw(&mut random).image()).check().is_ok());
    }
}
