//! Exported files against the images that they come from.

use std::path::Path;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Mul, Normalize, Pointwise, RmsNorm, Span};
use actq::graph::{Evaluator, Graph, NodeKind, WeightMatrix};
use actq::measure::unrounded::Unrounded;
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::ImageBuffer;
use actq_kernels::Width;
use actq_kernels::math::Function;

use super::{file, network};
use crate::{ImportOptions, import_bytes};

const OBS: usize = 5;
const HIDDEN: usize = 8;

struct Made {
    random: Random,
    graph: Graph,
}

impl Made {
    fn new() -> Self {
        Self { random: Random::new(1), graph: Graph::new(OBS) }
    }

    fn values(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.random.unit()).collect()
    }

    fn matrix(&mut self, rows: usize, cols: usize) -> usize {
        let matrix = WeightMatrix { name: String::new(), rows, cols, data: self.values(rows * cols) };
        self.graph.add_matrix(matrix).expect("a matrix")
    }

    fn add(&mut self, kind: impl Into<NodeKind>, inputs: &[usize]) -> usize {
        self.graph.add(kind, inputs).expect("it fits")
    }

    fn image(self) -> ImageBuffer {
        let options = Options { group: 32, ..Options::new(Method::Rtn, Budget::Width(Width::W4)) };
        let policy = Policy::of("made", self.graph);
        quantize(&policy, &Recordings::default(), &options, ()).expect("an image").buffer()
    }
}

/// Makes a network with norms, a residual and every function.
fn feed_forward() -> ImageBuffer {
    let mut made = Made::new();
    let (mean, scale) = (made.values(OBS), vec![1.5; OBS]);
    made.add(Normalize { mean, scale, pre_clip: f32::INFINITY, clip: 3.0 }, &[0]);
    let (matrix, bias) = (made.matrix(HIDDEN, OBS), made.values(HIDDEN));
    let mut x = made.add(Linear { matrix, bias }, &[1]);
    let skipped = x;
    for function in Function::ALL {
        // Differences to the next function's are large after a norm.
        let (weight, bias) = (made.values(HIDDEN), made.values(HIDDEN));
        x = made.add(LayerNorm { weight, bias, eps: 1e-5 }, &[x]);
        x = made.add(Pointwise(function), &[x]);
    }
    let weight = made.values(HIDDEN);
    x = made.add(RmsNorm { weight, eps: 1e-6 }, &[x]);
    x = made.add(Mul, &[x, skipped]);
    x = made.add(Add, &[x, skipped]);
    let spans = vec![Span { from: 0, len: 3 }, Span { from: 2, len: 4 }];
    x = made.add(Concat(spans), &[x, skipped]);
    let (matrix, bias) = (made.matrix(2, 7), made.values(2));
    made.add(Linear { matrix, bias }, &[x]);
    made.image()
}

#[test]
fn imported_again_a_file_computes_the_same() {
    let buffer = feed_forward();
    let image = buffer.image(Path::new("made")).expect("an image");
    let bytes = file(&network(&image).expect("a network"), image.name());
    let imported = import_bytes(bytes, Path::new("."), "made", &ImportOptions::default()).expect("a file");
    let policy = imported.source.policy(Path::new("."), Path::new("made")).expect("a policy");
    let (mut evaluator, mut unrounded) = (Evaluator::new(&policy.graph), Unrounded::new(image));
    let mut random = Random::new(2);
    for _ in 0..20 {
        let obs: Vec<f32> = (0..OBS).map(|_| 2.0 * random.unit()).collect();
        let (ours, expected) = (evaluator.step(&obs, &mut |_, _| {}), unrounded.infer(&obs).expect("it runs"));
        let off = ours.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 2e-5, "{ours:?} instead of {expected:?}");
    }
}

#[test]
fn recurrent_networks_have_ports_for_their_state() {
    let mut made = Made::new();
    let (input, state) = (made.matrix(4 * HIDDEN, OBS), made.matrix(4 * HIDDEN, HIDDEN));
    let bias = made.values(4 * HIDDEN);
    made.add(Lstm { hidden: HIDDEN, input, state, bias }, &[0]);
    let (input, state) = (made.matrix(3 * HIDDEN, HIDDEN), made.matrix(3 * HIDDEN, HIDDEN));
    let (input_bias, state_bias) = (made.values(3 * HIDDEN), made.values(3 * HIDDEN));
    made.add(Gru { hidden: HIDDEN, input, state, input_bias, state_bias }, &[1]);
    let (matrix, bias) = (made.matrix(2, HIDDEN), made.values(2));
    made.add(Linear { matrix, bias }, &[2]);
    let buffer = made.image();
    let found = network(&buffer.image(Path::new("made")).expect("an image")).expect("a network");
    assert_eq!(found.inputs, [("obs".to_owned(), OBS), ("state".to_owned(), 3 * HIDDEN)]);
    assert_eq!(found.outputs, [("action".to_owned(), vec![2]), ("next_state".to_owned(), vec![3 * HIDDEN])]);
    // Every node reads what is there.
    let mut there: Vec<&str> = found.inputs.iter().map(|(name, _)| &**name).collect();
    there.extend(found.tensors.iter().map(|tensor| &*tensor.name));
    for node in &found.nodes {
        assert!(node.inputs.iter().all(|name| there.contains(&&**name)), "{node:?}");
        there.push(&node.output);
    }
}
