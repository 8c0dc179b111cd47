//! Images with impossible operations around their network, or impossible raw inputs and targets.

use actq_kernels::ImageError as E;
use actq_kernels::image::{header as h, op};
use anyhow::Result;

use super::draft::{Case, NAN, refused_of};
use crate::deployed::Made;
use crate::draft::Draft;

/// Returns the position of the ports: after the self-test.
fn ports(d: &Draft) -> usize {
    let steps = d.low(h::W_STEPS_NAME) * (d.low(h::W_SIZES) + d.high(h::W_SIZES));
    d.offset(h::W_SELF_TEST) + steps as usize
}

/// An operation of each kind: its code, and its number among those of it.
const SELECT: (u8, usize) = (op::SELECT, 0);
const CONSTANT: (u8, usize) = (op::CONSTANT, 0);
const START: (u8, usize) = (op::INITIAL, 0);
const ROW: (u8, usize) = (op::TABLE_ROW, 0);
const STAND: (u8, usize) = (op::STANDSTILL, 0);
const HISTORY: (u8, usize) = (op::HISTORY, 0);
const CLIP: (u8, usize) = (op::CLIP, 0);

/// The third region of the record of an operation.
const THIRD: usize = 2;

#[test]
fn impossible_operations_around_a_network_are_refused() -> Result<()> {
    let cases: &[Case] = &[
        ("an index of select after the source", E::Around, |d| d.set_low(d.data(SELECT) + 1, d.low(d.data(SELECT)))),
        ("select of no values", E::Around, |d| d.set_low(d.data(SELECT), 0)),
        ("a quaternion of other than 4 values", E::Around, |d| d.set_high(d.data(SELECT), 1)),
        ("an unknown check of select", E::Around, |d| d.set_high(d.data(SELECT), 2)),
        ("select of words up to its result", E::Overlap, |d| d.set_low(d.data(SELECT), 0xffff)),
        ("a constant NaN", E::Constant, |d| d.set_f32(d.data(CONSTANT), NAN)),
        ("a start NaN", E::Constant, |d| d.set_f32(d.data(START), NAN)),
        ("a count of start outside", E::Unwritten, |d| d.set_high(d.op(START) + THIRD, 0xffff)),
        ("a table without rows", E::Around, |d| d.set_low(d.data(ROW), 0)),
        ("more rows than words", E::Section, |d| d.set_low(d.data(ROW), 0xffff)),
        ("a first row after the last", E::Around, |d| d.set_high(d.data(ROW), d.low(d.data(ROW)))),
        ("a next row after the last", E::Around, |d| d.set_low(d.data(ROW) + 1, d.low(d.data(ROW)))),
        ("a reserved half of row", E::Around, |d| d.set_high(d.data(ROW) + 1, 1)),
        ("a row NaN", E::Constant, |d| d.set_f32(d.data(ROW) + 2, NAN)),
        ("a limit of 0", E::Around, |d| d.set_f32(d.data(STAND) + 1, 0.0)),
        ("a limit NaN", E::Around, |d| d.set_f32(d.data(STAND) + 1, NAN)),
        // Two phases and then the lengths of the groups.
        ("groups that are not the source", E::Around, |d| d.map_low(d.data(STAND) + 4, |len| len + 1)),
        ("a history of one frame more", E::Around, |d| d.map_low(d.data(HISTORY) + 1, |frames| frames + 1)),
        ("a history without stride", E::Around, |d| d.set_high(d.data(HISTORY) + 1, 0)),
        ("a history of another stride", E::Around, |d| d.map_high(d.data(HISTORY) + 1, |stride| stride + 1)),
        ("a history of age 2", E::Around, |d| d.set_low(d.data(HISTORY) + 2, 2)),
        ("an unknown flag of a history", E::Around, |d| d.set_high(d.data(HISTORY) + 2, 4)),
        ("a ring of other slots", E::Around, |d| d.map_high(d.data(HISTORY), |slots| slots - 1)),
        ("a ring outside", E::Unwritten, |d| d.set_high(d.op(HISTORY) + THIRD, 0xfff0)),
        ("a ring over the frame", E::Overlap, |d| d.set_high(d.op(HISTORY) + THIRD, d.high(d.op(HISTORY) + 1))),
        ("a clip with data", E::Reserved, |d| d.set(d.op(CLIP) + 3, 40)),
        ("the code after the last", E::Op, |d| {
            d.map_low(d.op(HISTORY), |half| (half & !0xff) | u32::from(op::ROTARY + 1));
        }),
        ("a flag beside that of ports", E::Reserved, |d| d.set(h::W_KIND, d.get(h::W_KIND) | 2 << 8)),
        ("an input too few", E::Ports, |d| d.set(ports(d), d.get(ports(d)) - 1)),
        ("an input that is a target", E::Ports, |d| d.map_high(ports(d) + 1, |kind| kind | 1)),
        ("an unknown kind of port", E::Ports, |d| d.map_high(ports(d) + 1, |kind| kind | 4)),
        ("an input one value longer", E::Ports, |d| d.map_low(ports(d) + 1, |len| len + 1)),
        ("a range upside down", E::Ports, |d| {
            d.set_f32(ports(d) + 2, 1.0);
            d.set_f32(ports(d) + 3, 0.5);
        }),
        ("a range NaN", E::Ports, |d| d.set_f32(ports(d) + 3, NAN)),
        ("a name outside", E::Section, |d| d.set(ports(d) + 4, d.0.len() as u32)),
        ("a name that is none", E::Ports, |d| d.set_high(ports(d) + 1, 0)),
        ("a name with a control character", E::Ports, |d| d.set(d.offset(ports(d) + 4), 7)),
        ("names of values outside", E::Section, |d| d.set(ports(d) + 5, d.0.len() as u32)),
        ("names of values in the header", E::Section, |d| d.set(ports(d) + 5, 1)),
        ("names of values that are none", E::Ports, |d| d.set(d.offset(ports(d) + 5), 0)),
        ("a name too few", E::Ports, |d| d.set(d.offset(ports(d) + 5), 3)),
        ("a name of a value that is empty", E::Ports, |d| {
            // "a\nb\nc" becomes "a\n\ncc".
            let text = d.offset(ports(d) + 5) + 1;
            d.set(text, u32::from_le_bytes(*b"a\n\nc"));
        }),
        ("a name of a value with a control character", E::Ports, |d| {
            let text = d.offset(ports(d) + 5) + 1;
            d.set(text, u32::from_le_bytes(*b"a\n\x07\n"));
        }),
    ];
    refused_of(&Draft::of(&Made::deployment()?.1.four_bits()?), cases);
    Ok(())
}
