//! Images with impossible operations around their network, or impossible raw inputs and targets.

use actq_kernels::ImageError as E;
use actq_kernels::image::{header as h, op};
use anyhow::Result;

use super::draft::{Case, NAN, refused_of};
use crate::deployed::{Made, four_bits};
use crate::draft::Draft;

/// Returns the position of the ports: after the self-test.
fn ports(d: &Draft) -> usize {
    let steps = d.low(h::W_STEPS_NAME) * (d.low(h::W_SIZES) + d.high(h::W_SIZES));
    d.offset(h::W_SELF_TEST) + steps as usize
}

/// The third region of the record of an operation.
const THIRD: usize = 2;

#[test]
fn impossible_operations_around_a_network_are_refused() -> Result<()> {
    let cases: &[Case] = &[
        ("an index of select after the source", E::Around, |d| {
            let data = d.data((op::SELECT, 0));
            d.set_low(data + 1, d.low(data));
        }),
        ("select of no values", E::Around, |d| d.set_low(d.data((op::SELECT, 0)), 0)),
        ("a reserved half of select", E::Around, |d| d.set_high(d.data((op::SELECT, 0)), 1)),
        ("select of words up to its result", E::Overlap, |d| d.set_low(d.data((op::SELECT, 0)), 0xffff)),
        ("a constant NaN", E::Constant, |d| d.set_f32(d.data((op::CONSTANT, 0)), NAN)),
        ("a start NaN", E::Constant, |d| d.set_f32(d.data((op::START, 0)), NAN)),
        ("a count of start outside", E::Unwritten, |d| d.set_high(d.op((op::START, 0)) + THIRD, 0xffff)),
        ("a table without rows", E::Around, |d| d.set_low(d.data((op::ROW, 0)), 0)),
        ("more rows than words", E::Section, |d| d.set_low(d.data((op::ROW, 0)), 0xffff)),
        ("a first row after the last", E::Around, |d| {
            let data = d.data((op::ROW, 0));
            d.set_high(data, d.low(data));
        }),
        ("a next row after the last", E::Around, |d| {
            let data = d.data((op::ROW, 0));
            d.set_low(data + 1, d.low(data));
        }),
        ("a reserved half of row", E::Around, |d| d.set_high(d.data((op::ROW, 0)) + 1, 1)),
        ("a row NaN", E::Constant, |d| d.set_f32(d.data((op::ROW, 0)) + 2, NAN)),
        ("a limit of 0", E::Around, |d| d.set_f32(d.data((op::STAND, 0)) + 1, 0.0)),
        ("a limit NaN", E::Around, |d| d.set_f32(d.data((op::STAND, 0)) + 1, NAN)),
        ("groups that are not the source", E::Around, |d| {
            // Two phases and then the lengths of the groups.
            let lens = d.data((op::STAND, 0)) + 4;
            d.set_low(lens, d.low(lens) + 1);
        }),
        ("a history of one frame more", E::Around, |d| {
            let data = d.data((op::HISTORY, 0)) + 1;
            d.set_low(data, d.low(data) + 1);
        }),
        ("a history without stride", E::Around, |d| d.set_high(d.data((op::HISTORY, 0)) + 1, 0)),
        ("a history of another stride", E::Around, |d| {
            let data = d.data((op::HISTORY, 0)) + 1;
            d.set_high(data, d.high(data) + 1);
        }),
        ("a history of age 2", E::Around, |d| d.set_low(d.data((op::HISTORY, 0)) + 2, 2)),
        ("an unknown flag of a history", E::Around, |d| d.set_high(d.data((op::HISTORY, 0)) + 2, 4)),
        ("a ring of other slots", E::Around, |d| {
            let data = d.data((op::HISTORY, 0));
            d.set_high(data, d.high(data) - 1);
        }),
        ("a ring outside", E::Unwritten, |d| d.set_high(d.op((op::HISTORY, 0)) + THIRD, 0xfff0)),
        ("a ring over the frame", E::Overlap, |d| {
            let record = d.op((op::HISTORY, 0));
            d.set_high(record + THIRD, d.high(record + 1));
        }),
        ("a clip with data", E::Reserved, |d| d.set(d.op((op::CLIP, 0)) + 3, 40)),
        ("the code after the last", E::Op, |d| {
            let record = d.op((op::HISTORY, 0));
            d.set(record, (d.get(record) & !0xff) | u32::from(op::HISTORY + 1));
        }),
        ("a flag beside that of ports", E::Reserved, |d| d.set(h::W_KIND, d.get(h::W_KIND) | 2 << 8)),
        ("an input too few", E::Ports, |d| {
            let ports = ports(d);
            d.set(ports, d.get(ports) - 1);
        }),
        ("an input that is a target", E::Ports, |d| {
            let record = ports(d) + 1;
            d.set_high(record, d.high(record) | 1);
        }),
        ("an unknown kind of port", E::Ports, |d| {
            let record = ports(d) + 1;
            d.set_high(record, d.high(record) | 4);
        }),
        ("an input one value longer", E::Ports, |d| {
            let record = ports(d) + 1;
            d.set_low(record, d.low(record) + 1);
        }),
        ("a range upside down", E::Ports, |d| {
            d.set_f32(ports(d) + 2, 1.0);
            d.set_f32(ports(d) + 3, 0.5);
        }),
        ("a range NaN", E::Ports, |d| d.set_f32(ports(d) + 3, NAN)),
        ("a name outside", E::Section, |d| d.set(ports(d) + 4, d.0.len() as u32)),
        ("a name that is none", E::Ports, |d| {
            let record = ports(d) + 1;
            d.set_high(record, 0);
        }),
        ("a name with a control character", E::Ports, |d| {
            let name = d.offset(ports(d) + 4);
            d.set(name, 7);
        }),
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
    refused_of(&Draft::of(&four_bits(&Made::deployment()?.1.policy)?), cases);
    Ok(())
}
