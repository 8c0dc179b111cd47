//! A valid image, and changes of it.

use std::sync::LazyLock;

use actq::budget::{Budget, Rate};
use actq::contract::ActionContract;
use actq::graph::ops::{LayerNorm, Linear, Lstm, Normalize, Pointwise};
use actq::graph::{Graph, NodeKind, WeightMatrix};
use actq::methods::{Method, Options, Outcome, quantize};
use actq::policy::Policy;
use actq_bench::golden::Random;
use actq_bench::networks::replace_row;
use actq_kernels::ImageError as E;
use actq_kernels::image::{Kind, op};
use actq_kernels::layout::Width;
use actq_kernels::math::Function;

use crate::draft::Draft;

pub(super) const OBS: usize = 10;
pub(super) const UNITS: usize = 24;
pub(super) const ACT: usize = 4;
pub(super) const CHUNK: usize = 2;

/// A policy with every kind of section: normalization, matrices of all widths with group scales, an LSTM, a matrix of
/// mixed widths with its output steps, a chunk and the whole contract.
fn valid_image() -> Vec<u8> {
    let mut random = Random::new(7);
    let mut values = |n: usize| (0..n).map(|_| random.unit()).collect::<Vec<f32>>();
    let mut graph = Graph::new(OBS);
    for (rows, cols) in [(UNITS, OBS), (4 * UNITS, UNITS), (4 * UNITS, UNITS), (CHUNK * ACT, UNITS)] {
        let name = format!("w{}", graph.matrices.len());
        graph.matrices.push(WeightMatrix { name, rows, cols, data: values(rows * cols) });
    }
    let nodes: [NodeKind; 6] = [
        Normalize { mean: values(OBS), scale: vec![0.5; OBS], pre_clip: 20.0, clip: 5.0 }.into(),
        Linear { matrix: 0, bias: values(UNITS) }.into(),
        Pointwise(Function::Elu).into(),
        LayerNorm { weight: values(UNITS), bias: values(UNITS), eps: 1e-5 }.into(),
        Lstm { hidden: UNITS, input: 1, state: 2, bias: values(4 * UNITS) }.into(),
        Linear { matrix: 3, bias: values(CHUNK * ACT) }.into(),
    ];
    for (input, kind) in nodes.into_iter().enumerate() {
        graph.add(kind, &[input]).expect("it fits");
    }
    let at_width = |width| {
        let options = Options { group: 32, ..Options::new(Method::Rtn, Budget::Width(width)) };
        quantize(&graph, None, Rate::Width(width), &options).expect("the graph can be quantized").1
    };
    let [w2, w3, w4, w8] = Width::ALL.map(at_width);
    let matrices = [w4[0].clone(), w3[1].clone(), w2[2].clone(), interleaved(&w2[3], &w8[3])];
    let policy = Policy {
        kind: Kind::Chunk,
        chunk: CHUNK,
        execute: CHUNK,
        act_len: ACT,
        contract: ActionContract {
            scale: Some(vec![0.5; ACT]),
            offset: Some(vec![0.1; ACT]),
            low: Some(vec![-1.0; ACT]),
            high: Some(vec![1.0; ACT]),
            max_step: Some(vec![0.25; ACT]),
            ..ActionContract::default()
        },
        digest: [7; 32],
        ..Policy::of("malformed", graph)
    };
    actq::emit::image(&policy, &matrices).expect("the policy fits the format")
}

/// Even rows of `a`, odd rows of `b`, for activations beyond int8, so that they are packed in single lanes.
fn interleaved(a: &Outcome, b: &Outcome) -> Outcome {
    let mut out = a.clone();
    out.x_max = 255;
    for row in (1..out.quantized.rows).step_by(2) {
        replace_row(&mut out.quantized, row, &b.quantized);
    }
    out
}

pub(super) static VALID: LazyLock<Draft> = LazyLock::new(|| Draft::of(&valid_image()));

/// Operations of the valid image: linear operations are the first layer, the LSTM's two products and the output layer.
pub(super) const FIRST: (u8, usize) = (op::LINEAR, 0);
pub(super) const INPUT: (u8, usize) = (op::LINEAR, 1);
pub(super) const STATE: (u8, usize) = (op::LINEAR, 2);
pub(super) const OUTPUT: (u8, usize) = (op::LINEAR, 3);
pub(super) const NORMALIZE: (u8, usize) = (op::NORMALIZE, 0);
pub(super) const LAYER_NORM: (u8, usize) = (op::LAYER_NORM, 0);
pub(super) const FUNCTION: (u8, usize) = (op::FUNCTION, 0);
pub(super) const LSTM: (u8, usize) = (op::LSTM_CELL, 0);

pub(super) const NAN: f32 = f32::NAN;
/// Offsets whose sum with a length does not fit 32 bits.
pub(super) const HUGE: u32 = u32::MAX - 1;

/// A change of an image.
pub(super) type Change = fn(&mut Draft);

/// The fault, the expected error, and the change of the valid image.
pub(super) type Case = (&'static str, E, Change);

/// Applies every case to the valid image, updates the checksum, and reports all cases that are not refused as expected.
pub(super) fn refused(cases: &[Case]) {
    refused_of(&VALID, cases);
}

/// Changes a valid image in each of these ways, and asserts each error.
pub(super) fn refused_of(valid: &Draft, cases: &[Case]) {
    let wrong = cases.iter().filter_map(|(name, expected, change)| {
        let mut draft = valid.clone();
        change(&mut draft);
        draft.seal();
        let got = draft.check().err();
        (got != Some(*expected)).then(|| format!("{name}: expected {expected:?}, got {got:?}"))
    });
    let wrong: Vec<_> = wrong.collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}
