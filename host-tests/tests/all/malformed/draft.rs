//! A valid image whose words tests change.

use std::sync::LazyLock;

use actq::budget::{Budget, Rate};
use actq::contract::ActionContract;
use actq::graph::ops::{LayerNorm, Linear, Lstm, Normalize, Pointwise};
use actq::graph::{Graph, NodeKind, WeightMatrix};
use actq::methods::{Method, Options, Outcome, quantize};
use actq::policy::Policy;
use actq_bench::golden::Random;
use actq_bench::networks::replace_row;
use actq_kernels::image::{Kind, checksum, header as h, op};
use actq_kernels::layout::Width;
use actq_kernels::math::Function;
use actq_kernels::{Image, ImageError as E};

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

/// An image whose words tests change.
#[derive(Clone)]
pub(super) struct Draft(pub(super) Vec<u32>);

pub(super) static VALID: LazyLock<Draft> = LazyLock::new(|| {
    let bytes = valid_image();
    Draft(bytes.chunks_exact(4).map(|w| u32::from_ne_bytes([w[0], w[1], w[2], w[3]])).collect())
});

/// Operations of the valid image: linear operations are the first layer, the LSTM's two products and the output layer.
pub(super) const FIRST: (u8, usize) = (op::LINEAR, 0);
pub(super) const INPUT: (u8, usize) = (op::LINEAR, 1);
pub(super) const STATE: (u8, usize) = (op::LINEAR, 2);
pub(super) const OUTPUT: (u8, usize) = (op::LINEAR, 3);
pub(super) const NORMALIZE: (u8, usize) = (op::NORMALIZE, 0);
pub(super) const LAYER_NORM: (u8, usize) = (op::LAYER_NORM, 0);
pub(super) const FUNCTION: (u8, usize) = (op::FUNCTION, 0);
pub(super) const LSTM: (u8, usize) = (op::LSTM_CELL, 0);

impl Draft {
    pub(super) fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }

    pub(super) fn check(&self) -> Result<Image<'_>, E> {
        Image::new_checked(self.bytes())
    }

    pub(super) fn get(&self, at: usize) -> u32 {
        u32::from_le(self.0[at])
    }

    pub(super) fn offset(&self, at: usize) -> usize {
        self.get(at) as usize
    }

    pub(super) fn low(&self, at: usize) -> u32 {
        self.get(at) & 0xffff
    }

    pub(super) fn high(&self, at: usize) -> u32 {
        self.get(at) >> 16
    }

    pub(super) fn set(&mut self, at: usize, value: u32) {
        self.0[at] = value.to_le();
    }

    pub(super) fn set_f32(&mut self, at: usize, value: f32) {
        self.set(at, value.to_bits());
    }

    pub(super) fn set_low(&mut self, at: usize, value: u32) {
        self.set(at, (self.get(at) & 0xffff_0000) | value);
    }

    pub(super) fn set_high(&mut self, at: usize, value: u32) {
        self.set(at, self.low(at) | value << 16);
    }

    /// Updates the checksum.
    pub(super) fn seal(&mut self) {
        self.set(h::W_CRC, checksum(self.bytes()));
    }

    /// Returns the position of the record of the `nth` operation with this code.
    pub(super) fn op(&self, (code, nth): (u8, usize)) -> usize {
        let records = (0..self.high(h::W_KIND) as usize).map(|i| self.offset(h::W_OPS) + i * h::OP_WORDS);
        records.filter(|&at| self.get(at) as u8 == code).nth(nth).expect("the image has the operation")
    }

    /// Returns the position of the constants or the matrix record of an operation.
    pub(super) fn data(&self, which: (u8, usize)) -> usize {
        self.offset(self.op(which) + 3)
    }

    /// Returns the position of block record `i` of a linear operation.
    pub(super) fn block(&self, which: (u8, usize), i: usize) -> usize {
        self.offset(self.data(which) + 3) + i * h::BLOCK_WORDS
    }
}

pub(super) const NAN: f32 = f32::NAN;
/// Offsets whose sum with a length does not fit 32 bits.
pub(super) const HUGE: u32 = u32::MAX - 1;

/// A change of an image.
pub(super) type Change = fn(&mut Draft);

/// The fault, the expected error, and the change of the valid image.
pub(super) type Case = (&'static str, E, Change);

/// Applies every case to the valid image, updates the checksum, and reports all cases that are not refused as expected.
pub(super) fn refused(cases: &[Case]) {
    let wrong = cases.iter().filter_map(|(name, expected, change)| {
        let mut draft = VALID.clone();
        change(&mut draft);
        draft.seal();
        let got = draft.check().err();
        (got != Some(*expected)).then(|| format!("{name}: expected {expected:?}, got {got:?}"))
    });
    let wrong: Vec<_> = wrong.collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}
