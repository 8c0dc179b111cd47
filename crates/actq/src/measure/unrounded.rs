//! The network of an image with activations in f32: the error that remains if only the weights are quantized.

use std::collections::BTreeMap;

use actq_kernels::Image;
use actq_kernels::image::{Cache, Matrix, Op, OpKind};
use actq_kernels::ops::run_whole;
use ndarray::{Array2, ArrayView1};

use crate::error::{Context as _, Result};
use crate::graph::Graph;
use crate::graph::ops::Attention;
use crate::runtime::{keys_and_values, prefix_len};

/// Keys and values in f32 of the tokens in each cache, by its arena offset.
type Caches = BTreeMap<usize, [Vec<f32>; 2]>;

/// Executor of an image with linear operations and attention in f32.
pub struct Unrounded<'a> {
    image: Image<'a>,
    ops: Vec<Op<'a>>,
    /// Weights of each operation; empty if it has none.
    weights: Vec<Array2<f32>>,
    arena: Vec<u32>,
    caches: Caches,
}

impl<'a> Unrounded<'a> {
    /// Dequantizes the weights of an image.
    pub fn new(image: Image<'a>) -> Self {
        let ops: Vec<Op<'a>> = image.ops().collect();
        let weights = ops.iter().map(|op| op.matrix().map_or(Array2::default((0, 0)), |matrix| dequantized(&matrix)));
        let (weights, arena) = (weights.collect(), vec![0; image.scratch_words()]);
        Self { image, weights, ops, arena, caches: Caches::new() }
    }

    /// Takes the weights of the graph that the image was made of, as they were before they were quantized.
    ///
    /// # Errors
    ///
    /// If the image has other matrices.
    pub fn with_weights(image: Image<'a>, graph: &Graph) -> Result<Self> {
        let mut unrounded = Self::new(image);
        let mut products = graph.nodes.iter().flat_map(|node| node.kind.products());
        for (op, weights) in unrounded.ops.iter().zip(&mut unrounded.weights) {
            if op.matrix().is_none() {
                continue;
            }
            let matrix = products.next().map(|product| &graph.matrices[product.matrix]);
            let matrix = matrix.filter(|matrix| weights.dim() == (matrix.rows, matrix.cols));
            let matrix = matrix.context("an operation has the matrix of another graph")?;
            weights.iter_mut().zip(&matrix.data).for_each(|(to, weight)| *to = *weight);
        }
        Ok(unrounded)
    }

    /// Returns the recurrent state.
    pub fn state_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.arena[self.image.state().range()])
    }

    /// Returns the network's raw output for an observation of the image's length, with its prefix and its noise.
    pub fn infer(&mut self, observation: &[f32]) -> Result<&[f32]> {
        let arena = &mut self.arena;
        let (observation, rest) = observation.split_at(self.image.obs_len());
        let (prefix, noise) = rest.split_at(prefix_len(&self.image));
        let mut at = self.image.state().range().end;
        for (cache, part) in keys_and_values(&self.image, prefix) {
            self.caches.insert(at, part.map(<[f32]>::to_vec));
            at += cache.words();
        }
        arena[self.image.observation().range()].copy_from_slice(bytemuck::cast_slice(observation));
        if let [Op { kind: OpKind::Noise, .. }, ..] = &self.ops[..] {
            arena[self.ops[0].dst().range()].copy_from_slice(bytemuck::cast_slice(noise));
        }
        for step in 0..self.image.denoising_steps() {
            let first = if step == 0 { 0 } else { self.image.first_denoising_op() };
            for (op, weights) in self.ops[first..].iter().zip(&self.weights[first..]) {
                match (op.kind, op.matrix()) {
                    (OpKind::Linear { accumulate, .. }, Some(matrix)) => {
                        multiply(op, &matrix, weights, accumulate, arena)
                    }
                    (OpKind::Keep, _) => keep(op, arena, &mut self.caches)?,
                    (OpKind::Attend, _) => attend(op, arena, &self.caches),
                    _ => run_whole(op, step, arena)?,
                }
            }
        }
        Ok(floats(&arena[self.image.output().range()]))
    }
}

/// Returns the weights of a matrix; rows that the image does not have are zero.
pub fn dequantized(matrix: &Matrix<'_>) -> Array2<f32> {
    let mut weights = Array2::zeros((matrix.rows, matrix.cols));
    let mut row = vec![0.0; matrix.cols];
    for rows in matrix.blocks() {
        for (i, output) in rows.outputs().enumerate() {
            rows.dequantize(i, &mut row);
            weights.row_mut(output).assign(&ArrayView1::from(&row));
        }
    }
    weights
}

/// Computes `dst = W src + b`, or adds it to `dst`, in f32.
fn multiply(op: &Op<'_>, matrix: &Matrix<'_>, weights: &Array2<f32>, accumulate: bool, arena: &mut [u32]) {
    let x: Vec<f32> = floats(&arena[op.src().range()]).to_vec();
    let y = bytemuck::cast_slice_mut::<u32, f32>(&mut arena[op.dst().range()]);
    for (row, (y, sum)) in y.iter_mut().zip(weights.dot(&ArrayView1::from(&x))).enumerate() {
        *y = if accumulate { *y } else { 0.0 } + matrix.bias(row) + sum;
    }
}

/// Keeps keys and values as the image does, and in f32.
fn keep(op: &Op<'_>, arena: &mut [u32], caches: &mut Caches) -> Result<()> {
    let sizes = op.cache();
    let before = arena[op.dst().offset];
    run_whole(op, 0, arena)?;
    let kept = caches.entry(op.dst().offset).or_default();
    for (kept, new) in kept.iter_mut().zip([op.src(), op.third()]) {
        if !op.is_ring() || before == 0 {
            // All but the tokens of a prefix, which a recording has in all its slots.
            let prefix = if sizes.own > 0 { sizes.prefix_slots() } else { 0 };
            kept.truncate(prefix * sizes.heads * sizes.dim);
        }
        kept.extend(floats(&arena[new.range()]));
        kept.drain(..kept.len().saturating_sub(sizes.slots * sizes.heads * sizes.dim));
    }
    Ok(())
}

/// Computes the outputs of queries in f32.
fn attend(op: &Op<'_>, arena: &mut [u32], caches: &Caches) {
    let Cache { heads: kv_heads, dim, .. } = op.cache();
    let (heads, factor, causal) = (op.query_heads(), op.score_factor(), op.is_causal());
    let of = Attention { heads, kv_heads, dim, factor, causal, context: 0 };
    let Some([keys, values]) = caches.get(&op.third().offset) else { return };
    let outputs = of.unrounded(floats(&arena[op.src().range()]), keys, values);
    arena[op.dst().range()].copy_from_slice(bytemuck::cast_slice(&outputs));
}

fn floats(words: &[u32]) -> &[f32] {
    bytemuck::cast_slice(words)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use actq_kernels::Width;
    use actq_kernels::math::Function;

    use super::*;
    use crate::budget::{Budget, Rate};
    use crate::emit;
    use crate::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Normalize, Pointwise, RmsNorm, Span};
    use crate::graph::{Evaluator, NodeKind, WeightMatrix};
    use crate::methods::{Activations, Method, Options, Outcome, quantize};
    use crate::policy::Policy;
    use crate::random::Random;
    use crate::runtime::{ImageBuffer, with_head};

    const OBS: usize = 5;
    const HIDDEN: usize = 8;
    const ACT: usize = 2;

    /// Makes a network with every operation.
    fn graph() -> Graph {
        let mut random = Random::new(3);
        let mut values = |n: usize| -> Vec<f32> { (0..n).map(|_| 0.5 * random.unit()).collect() };
        let mut graph = Graph::new(OBS);
        let shapes = [(HIDDEN, OBS), (4 * HIDDEN, HIDDEN), (4 * HIDDEN, HIDDEN), (3 * HIDDEN, HIDDEN + 3)];
        for (rows, cols) in shapes.into_iter().chain([(3 * HIDDEN, HIDDEN), (ACT, HIDDEN)]) {
            graph.matrices.push(WeightMatrix { name: String::new(), rows, cols, data: values(rows * cols) });
        }
        let spans = vec![Span { from: 0, len: HIDDEN }, Span { from: 1, len: 3 }];
        let nodes: [(NodeKind, &[usize]); 10] = [
            (Normalize { mean: values(OBS), scale: vec![1.5; OBS], pre_clip: 9.0, clip: 3.0 }.into(), &[0]),
            (Linear { matrix: 0, bias: values(HIDDEN) }.into(), &[1]),
            (Pointwise(Function::Silu).into(), &[2]),
            (LayerNorm { weight: vec![1.0; HIDDEN], bias: values(HIDDEN), eps: 1e-5 }.into(), &[3]),
            (Lstm { hidden: HIDDEN, input: 1, state: 2, bias: values(4 * HIDDEN) }.into(), &[4]),
            (Concat(spans).into(), &[5, 0]),
            (
                Gru {
                    hidden: HIDDEN,
                    input: 3,
                    state: 4,
                    input_bias: values(3 * HIDDEN),
                    state_bias: values(3 * HIDDEN),
                }
                .into(),
                &[6],
            ),
            (Add.into(), &[7, 5]),
            (RmsNorm { weight: vec![0.5; HIDDEN], eps: 1e-6 }.into(), &[8]),
            (Linear { matrix: 5, bias: values(ACT) }.into(), &[9]),
        ];
        for (kind, inputs) in nodes {
            graph.add(kind, inputs).expect("it fits");
        }
        graph
    }

    /// Returns the network that is quantized, with equalized elements, its outcomes and its image.
    fn image(graph: &Graph, width: Width, activations: Activations) -> (Graph, Vec<Outcome>, ImageBuffer) {
        let options = Options { group: 32, activations, ..Options::new(Method::Rtn, Budget::Width(width)) };
        let (graph, outcomes) = quantize(graph, None, Rate::Width(width), &options).expect("outcomes");
        let bytes = emit::image(&Policy::of("all", graph.clone()), &outcomes).expect("an image");
        (graph, outcomes, ImageBuffer::new(&bytes))
    }

    fn distance(a: &[f32], b: &[f32]) -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn unrounded_equals_the_f32_network_of_dequantized_weights() {
        let (mut dequantized, outcomes, buffer) = image(&graph(), Width::W3, Activations::Int8);
        let image = buffer.image(Path::new("memory")).expect("an image");
        for (matrix, outcome) in dequantized.matrices.iter_mut().zip(&outcomes) {
            matrix.data = outcome.quantized.dequantized();
        }
        let mut evaluator = Evaluator::new(&dequantized);
        let mut unrounded = Unrounded::new(image);
        let mut random = Random::new(4);
        let mut rounded: f32 = 0.0;
        with_head::<_, crate::error::Error>(image, |head| {
            for _ in 0..20 {
                let obs: Vec<f32> = (0..OBS).map(|_| 2.0 * random.unit()).collect();
                let expected = evaluator.step(&obs, &mut |_, _| {});
                let off = distance(unrounded.infer(&obs).expect("it runs"), &expected);
                assert!(off < 1e-5, "{off}");
                rounded = rounded.max(distance(head.infer(&obs)?, &expected));
            }
            Ok(())
        })
        .expect("the executor");
        assert!(rounded > 1e-4, "int8 activations make no difference: {rounded}");
    }

    #[test]
    fn unrounded_attention_is_that_of_the_network() {
        for (tokens, causal, context) in [(2, false, 0), (2, true, 0), (1, true, 3)] {
            let mut random = Random::new(6);
            let mut graph = Graph::new(OBS);
            let mut linear = |graph: &mut Graph, rows: usize, input: usize| {
                let (matrix, cols) = (graph.matrices.len(), graph.len_of(input));
                let data = (0..rows * cols).map(|_| random.unit()).collect();
                graph.matrices.push(WeightMatrix { name: String::new(), rows, cols, data });
                graph.add(Linear { matrix, bias: vec![0.1; rows] }, &[input]).expect("it fits")
            };
            let [queries, keys, values] = [12, 6, 6].map(|rows| linear(&mut graph, rows * tokens, 0));
            let attention = Attention { heads: 4, kv_heads: 2, dim: 3, factor: 0.7, causal, context };
            let outputs = graph.add(attention, &[queries, keys, values]).expect("it fits");
            linear(&mut graph, ACT, outputs);
            let (mut dequantized, outcomes, buffer) = image(&graph, Width::W8, Activations::Int8);
            for (matrix, outcome) in dequantized.matrices.iter_mut().zip(&outcomes) {
                matrix.data = outcome.quantized.dequantized();
            }
            let mut evaluator = Evaluator::new(&dequantized);
            let mut unrounded = Unrounded::new(buffer.image(Path::new("memory")).expect("an image"));
            for _ in 0..3 {
                evaluator.start(None);
                unrounded.state_mut().fill(0.0);
                for _ in 0..8 {
                    let obs: Vec<f32> = (0..OBS).map(|_| 2.0 * random.unit()).collect();
                    let expected = evaluator.step(&obs, &mut |_, _| {});
                    let off = distance(unrounded.infer(&obs).expect("it runs"), &expected);
                    assert!(off < 1e-5, "{tokens} tokens, causal {causal}, context {context}: {off}");
                }
            }
        }
    }

    /// Checks that the recorded state means the same to the f32 network, to the executor and to [`Unrounded`].
    #[test]
    fn states_have_one_order() {
        let graph = graph();
        assert_eq!(graph.state_len(), 3 * HIDDEN);
        let (_, _, buffer) = image(&graph, Width::W8, Activations::Int16);
        let image = buffer.image(Path::new("memory")).expect("an image");
        let mut random = Random::new(5);
        let state: Vec<f32> = (0..3 * HIDDEN).map(|_| random.unit()).collect();
        let obs = [0.5; OBS];
        let mut evaluator = Evaluator::new(&graph);
        let from_zero = evaluator.step(&obs, &mut |_, _| {});
        evaluator.start(Some(&state));
        let expected = evaluator.step(&obs, &mut |_, _| {});
        let mut unrounded = Unrounded::new(image);
        unrounded.state_mut().copy_from_slice(&state);
        let ours = unrounded.infer(&obs).expect("it runs").to_vec();
        let executed = with_head::<_, crate::error::Error>(image, |head| {
            head.state_mut().copy_from_slice(&state);
            Ok(head.infer(&obs)?.to_vec())
        })
        .expect("the executor");
        assert!(distance(&expected, &from_zero) > 0.1, "the state makes no difference");
        for (output, what) in [(ours, "unrounded"), (executed, "executor")] {
            assert!(distance(&output, &expected) < 0.02, "{what}: {output:?} against {expected:?}");
        }
    }
}
