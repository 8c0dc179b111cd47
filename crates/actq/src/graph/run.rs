//! The network on batches, forwards and backwards: the only interpreter of a graph in f32.
//!
//! Values are matrices `[sample, element]`, or, if several steps run at once, `[frame, element]`: all samples of
//! the first step, then all of the second. Only nodes with a state see the difference; for all others a sequence is a
//! larger batch. The gradient runs back through all steps. The tests compare the derivatives with finite differences.

use std::ops::Range;

use ndarray::{Array2, s};

use super::denoising::Iterates;
use super::nodes::Graph;
use super::operation::{Backward, Forward, Saved, Values};
use super::values::ValueId;
use super::weights::{Derivatives, State, Weights};

/// Values of a forward pass.
#[derive(Debug)]
pub struct Pass {
    /// The observation, then every node's output; for an iterative head, only nodes that run once.
    pub values: Vec<Array2<f32>>,
    saved: Vec<Saved>,
    /// Values of each denoising step.
    steps: Vec<StepPass>,
    /// The iterate after the last denoising step.
    denoised: Option<Array2<f32>>,
}

/// Values of a denoising step.
#[derive(Debug)]
struct StepPass {
    /// Iterates before it.
    at: Iterates,
    values: Vec<Array2<f32>>,
    saved: Vec<Saved>,
}

/// Inputs of a denoising step.
#[derive(Clone, Copy)]
struct OfStep<'v> {
    step: usize,
    /// Value that the network reads of the iterate.
    iterate: &'v Array2<f32>,
    /// Values of the nodes that run once.
    once: &'v [Array2<f32>],
}

impl Pass {
    /// Returns the network's output.
    pub fn output(&self) -> &Array2<f32> {
        self.denoised.as_ref().unwrap_or_else(|| &self.values[self.values.len() - 1])
    }

    /// Returns every value with its identifier; those of denoising steps once for each step.
    pub fn all_values(&self) -> impl Iterator<Item = (ValueId, &Array2<f32>)> {
        let of_step = |step: &'_ StepPass| self.values.len()..self.values.len() + step.values.len();
        let of_steps = self.steps.iter().flat_map(move |step| of_step(step).zip(&step.values));
        self.values.iter().enumerate().chain(of_steps)
    }

    /// Returns the network's output and drops the other values.
    pub fn into_output(mut self) -> Array2<f32> {
        self.denoised.or_else(|| self.values.pop()).unwrap_or_default()
    }
}

/// A network to run: its structure and its arithmetic.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    /// Structure.
    pub graph: &'a Graph,
    /// Activation magnitude that each matrix's input is rounded to (0 = no rounding), or empty.
    x_max: &'a [u16],
}

impl<'a> Network<'a> {
    /// Computes without rounding.
    pub fn new(graph: &'a Graph) -> Self {
        Self { graph, x_max: &[] }
    }

    /// As [`Self::new`], but rounds each matrix's input to this activation magnitude.
    pub fn rounded(graph: &'a Graph, x_max: &'a [u16]) -> Self {
        Self { graph, x_max }
    }

    /// Runs one or more steps for a batch of observations, whose size is that of `state`, which advances. For an
    /// iterative head, noise follows each observation.
    pub fn forward(&self, weights: &Weights, obs: Array2<f32>, state: &mut State) -> Pass {
        let Some(denoising) = &self.graph.denoising else {
            let (mut values, mut saved) = (vec![obs], Vec::with_capacity(self.graph.nodes.len()));
            self.run(weights, 0..self.graph.nodes.len(), None, &mut values, &mut saved, state);
            return Pass { values, saved, steps: Vec::new(), denoised: None };
        };
        let (first, end) = (denoising.first, self.graph.nodes.len());
        let noise = obs.slice(s![.., self.graph.obs_len..]).to_owned();
        let (mut values, mut saved) = (vec![obs.slice(s![.., ..self.graph.obs_len]).to_owned()], Vec::new());
        self.run(weights, 0..first, None, &mut values, &mut saved, state);
        let mut at = denoising.start(noise.view());
        let mut steps = Vec::with_capacity(denoising.steps.len());
        for step in 0..denoising.steps.len() {
            let mut of_step = (Vec::with_capacity(end - first), Vec::with_capacity(end - first));
            self.run(
                weights,
                first..end,
                Some(OfStep { step, iterate: &at.y, once: &values }),
                &mut of_step.0,
                &mut of_step.1,
                state,
            );
            let next = denoising.next(step, &at, &of_step.0[end - first - 1], noise.view());
            steps.push(StepPass { at, values: of_step.0, saved: of_step.1 });
            at = next;
        }
        Pass { values, saved, steps, denoised: Some(at.x) }
    }

    /// Runs one step for one observation, whose noise follows it; returns the network's output.
    pub fn forward_one(&self, weights: &Weights, obs: &[f32], state: &mut State) -> Vec<f32> {
        let obs = Array2::from_shape_fn((1, obs.len()), |(_, i)| obs[i]);
        self.forward(weights, obs, state).into_output().into_iter().collect()
    }

    /// Runs nodes, outside of denoising steps or within one.
    fn run(
        &self,
        weights: &Weights,
        nodes: Range<usize>,
        step: Option<OfStep<'_>>,
        values: &mut Vec<Array2<f32>>,
        saved: &mut Vec<Saved>,
        state: &mut State,
    ) {
        for i in nodes {
            let node = &self.graph.nodes[i];
            let run = Forward {
                values: match step {
                    Some(OfStep { once, .. }) => Values { once, of_step: values },
                    None => Values { once: values, of_step: &[] },
                },
                inputs: &node.inputs,
                matrices: &weights.matrices,
                vectors: &weights.vectors[i],
                iterate: step.map(|of| of.iterate),
                step: step.map_or(0, |of| of.step),
                x_max: self.x_max,
            };
            let (y, keep) = node.kind.forward(&run, &mut state[i]);
            values.push(y);
            saved.push(keep);
        }
    }

    /// Returns every matrix with its operand, in the order of evaluation.
    pub fn operands<'p>(&self, pass: &'p Pass) -> impl Iterator<Item = (usize, &'p Array2<f32>)> {
        let nodes = self.graph.nodes.as_slice();
        let of_node = |(node, saved): (&'a super::nodes::Node, &'p Saved)| {
            node.kind.products().into_iter().map(|product| product.matrix).zip(&saved.operands)
        };
        let of_steps =
            pass.steps.iter().flat_map(move |step| nodes[nodes.len() - step.saved.len()..].iter().zip(&step.saved));
        nodes.iter().zip(&pass.saved).chain(of_steps).flat_map(of_node)
    }

    /// Backpropagates through a pass. `d_output` is the loss's derivative by the network's output; `d_state`, by the state
    /// after the pass, becomes that by the state before it. Returns the derivatives by the weights.
    pub fn backward(&self, weights: &Weights, pass: Pass, d_output: Array2<f32>, d_state: &mut State) -> Derivatives {
        let nodes = self.graph.nodes.len();
        let mut derivatives = Derivatives { products: Vec::new(), vectors: weights.zero_vectors() };
        let mut d_values: Vec<Option<Array2<f32>>> = vec![None; nodes + 1];
        let Pass { values, saved, steps, .. } = pass;
        let mut back = Back { network: self, weights, d_values: &mut d_values, d_state, to: &mut derivatives };
        let once = Values { once: &values, of_step: &[] };
        let Some(denoising) = &self.graph.denoising else {
            back.d_values[nodes] = Some(d_output);
            back.through(0, once, saved, 0);
            return derivatives;
        };
        let mut d = Iterates { y: Array2::zeros(d_output.raw_dim()), x: d_output };
        for (step, of_step) in steps.into_iter().enumerate().rev() {
            let v = &of_step.values[of_step.values.len() - 1];
            let (dx, dv) = denoising.back(step, &of_step.at, v, d);
            back.d_values[nodes] = Some(dv);
            let values = Values { once: &values, of_step: &of_step.values };
            let dy = back.through(denoising.first, values, of_step.saved, step);
            d = Iterates { y: dy.unwrap_or_else(|| Array2::zeros(dx.raw_dim())), x: dx };
        }
        back.through(0, once, saved, 0);
        derivatives
    }
}

/// A backward pass.
struct Back<'a, 'n> {
    network: &'a Network<'n>,
    weights: &'a Weights,
    /// Derivatives by all values, as far as they are known.
    d_values: &'a mut [Option<Array2<f32>>],
    d_state: &'a mut State,
    to: &'a mut Derivatives,
}

impl Back<'_, '_> {
    /// Backpropagates through the nodes from `first` on: those of a denoising step, or those that run once. Returns the
    /// derivative by the value that the network reads of the iterate.
    fn through(&mut self, first: usize, values: Values<'_>, saved: Vec<Saved>, step: usize) -> Option<Array2<f32>> {
        let mut d_iterate = None;
        let Derivatives { products, vectors } = &mut *self.to;
        for (i, saved) in saved.into_iter().enumerate().rev().map(|(i, saved)| (first + i, saved)) {
            let node = &self.network.graph.nodes[i];
            let dy = match self.d_values[i + 1].take() {
                Some(dy) => dy,
                // A later step's use of the state still counts.
                None if node.kind.state_lens() != [0, 0] => Array2::zeros(values.of(i + 1).raw_dim()),
                None => continue,
            };
            let mut run = Backward {
                node: i,
                values,
                inputs: &node.inputs,
                matrices: &self.weights.matrices,
                vectors: &self.weights.vectors[i],
                step,
                d_iterate: &mut d_iterate,
                d_values: self.d_values,
                products,
                d_vectors: &mut vectors[i],
            };
            node.kind.backward(&mut run, saved, dy, &mut self.d_state[i]);
        }
        d_iterate
    }
}

#[cfg(test)]
pub(super) mod tests {
    use actq_kernels::math::Function;
    use actq_kernels::ops::denoise::Coefficients;

    use super::*;
    use crate::graph::Denoising;
    use crate::graph::ops::{
        Add, Attention, Concat, Gru, LayerNorm, Linear, Lstm, Mul, NodeKind, Normalize, Pointwise, RmsNorm, Span,
    };
    use crate::graph::ops::{Iterate, Rotary, Table};
    use crate::graph::values::{ValueId, WeightMatrix};
    use crate::graph::weights::{Vectors, zero_state};
    use crate::random::Random;

    fn random(len: usize, seed: &mut Random) -> Vec<f32> {
        (0..len).map(|_| seed.unit()).collect()
    }

    /// Makes a graph with every kind of node.
    fn graph() -> Graph {
        let mut seed = Random::new(11);
        let mut graph = Graph::new(5);
        for (rows, cols) in
            [(6, 5)].into_iter().chain([(6, 6); Function::ALL.len()]).chain([(16, 7), (16, 4), (9, 4), (9, 3), (2, 3)])
        {
            let data = random(rows * cols, &mut seed).iter().map(|w| 0.6 * w).collect();
            graph.matrices.push(WeightMatrix { name: "m".into(), rows, cols, data });
        }
        let mut push = |kind: NodeKind, inputs: &[ValueId]| graph.add(kind, inputs).expect("it fits");
        let vector = |n: usize, seed: u64| random(n, &mut Random::new(seed));
        let weight = |n: usize, seed: u64| vector(n, seed).iter().map(|v| 1.0 + 0.3 * v).collect::<Vec<_>>();
        let normalize = Normalize { mean: vector(5, 1), scale: weight(5, 2), pre_clip: 10.0, clip: 3.0 };
        let normal = push(normalize.into(), &[0]);
        let mut last = push(Linear { matrix: 0, bias: vector(6, 3) }.into(), &[normal]);
        let kept = last;
        for (i, function) in Function::ALL.into_iter().enumerate() {
            last = push(Linear { matrix: 1 + i, bias: vector(6, 4) }.into(), &[last]);
            last = push(Pointwise(function).into(), &[last]);
            last = push(Add.into(), &[last, kept]);
        }
        // A product of two values, and one of a value with itself.
        last = push(Mul.into(), &[last, kept]);
        last = push(Mul.into(), &[last, last]);
        last = push(LayerNorm { weight: weight(6, 12), bias: vector(6, 13), eps: 1e-3 }.into(), &[last]);
        last = push(LayerNorm { weight: weight(6, 5), bias: vector(6, 6), eps: 1e-3 }.into(), &[last]);
        let spans = vec![Span { from: 1, len: 4 }, Span { from: 0, len: 3 }];
        last = push(Concat(spans).into(), &[last, normal]);
        last = push(RmsNorm { weight: weight(7, 7), eps: 1e-3 }.into(), &[last]);
        let next = 1 + Function::ALL.len();
        last = push(Lstm { hidden: 4, input: next, state: next + 1, bias: vector(16, 8) }.into(), &[last]);
        let (input_bias, state_bias) = (vector(9, 9), vector(9, 10));
        last = push(Gru { hidden: 3, input: next + 2, state: next + 3, input_bias, state_bias }.into(), &[last]);
        push(Linear { matrix: next + 4, bias: vector(2, 11) }.into(), &[last]);
        graph
    }

    /// Returns a function that adds a product with random weights, to this number of rows.
    fn linears() -> impl FnMut(&mut Graph, usize, ValueId) -> ValueId {
        let mut seed = Random::new(14);
        move |graph, rows, input| {
            let cols = graph.len_of(input);
            let data = random(rows * cols, &mut seed);
            let matrix = graph.add_matrix(WeightMatrix { name: "m".into(), rows, cols, data }).expect("a matrix");
            graph.add(Linear { matrix, bias: random(rows, &mut seed) }, &[input]).expect("it fits")
        }
    }

    /// Makes a network of attention: causal to the three tokens of an evaluation, with one head of keys and values for two
    /// of queries with rotary positions, then to the last two steps.
    pub(in crate::graph) fn attentive() -> Graph {
        let (mut graph, mut linear) = (Graph::new(5), linears());
        let full = Attention { heads: 2, kv_heads: 1, dim: 2, factor: 0.7, causal: true, context: 0 };
        let inputs = [12, 6, 6].map(|rows| linear(&mut graph, rows, 0));
        let angles = [0.0f32, 0.9, -2.0];
        let [cos, sin] = [f32::cos, f32::sin].map(|f| angles.map(f).to_vec());
        let inputs =
            [graph.add(Rotary { heads: 2, dim: 2, cos, sin }, &inputs[..1]).expect("it fits"), inputs[1], inputs[2]];
        let tokens = graph.add(full, &inputs).expect("it fits");
        let inputs = [4, 2, 2].map(|rows| linear(&mut graph, rows, tokens));
        let last = graph.add(Attention { causal: false, context: 2, ..full }, &inputs).expect("it fits");
        linear(&mut graph, 2, last);
        graph
    }

    const STEPS: usize = 3;

    fn observations() -> Vec<Array2<f32>> {
        let mut seed = Random::new(5);
        (0..STEPS).map(|_| Array2::from_shape_fn((2, 5), |_| seed.unit())).collect()
    }

    /// Makes a head of three values of observation and two of noise, whose steps use every coefficient but that of
    /// further noise.
    pub(in crate::graph) fn iterative() -> Graph {
        let mut seed = Random::new(12);
        let mut graph = Graph::new(3);
        for (rows, cols) in [(4, 3), (4, 2), (2, 4)] {
            let data = random(rows * cols, &mut seed);
            graph.matrices.push(WeightMatrix { name: "m".into(), rows, cols, data });
        }
        let mut push = |kind: NodeKind, inputs: &[ValueId]| graph.add(kind, inputs).expect("it fits");
        let condition = push(Linear { matrix: 0, bias: vec![0.1; 4] }.into(), &[0]);
        let x = push(Iterate { len: 2 }.into(), &[]);
        let x = push(Linear { matrix: 1, bias: vec![0.2; 4] }.into(), &[x]);
        let time = push(Table { rows: random(3 * 4, &mut Random::new(13)), len: 4 }.into(), &[]);
        let sum = push(Add.into(), &[x, time]);
        let sum = push(Add.into(), &[sum, condition]);
        let y = push(Pointwise(Function::Tanh).into(), &[sum]);
        push(Linear { matrix: 2, bias: vec![0.3; 2] }.into(), &[y]);
        let step = |k: f32| Coefficients::from_array([0.9, -0.3 * k, 0.6, 0.2 * k, 0.4, 0.0, 0.15]);
        let steps = [1.0, 1.5, 2.0].map(step).to_vec();
        graph.denoising = Some(Denoising { first: 1, len: 2, limit: 10.0, steps });
        graph
    }

    /// Computes a loss over all steps with different weights on each output.
    fn loss(graph: &Graph, weights: &Weights) -> f64 {
        let network = Network::new(graph);
        let mut state = zero_state(graph, 2);
        let mut sum = 0.0;
        for (t, obs) in observations().into_iter().enumerate() {
            let pass = network.forward(weights, obs, &mut state);
            sum += pass.output().iter().enumerate().map(|(i, y)| f64::from(*y) * (1 + i + t) as f64).sum::<f64>();
        }
        sum
    }

    fn gradient(graph: &Graph, weights: &Weights) -> (Vec<Array2<f32>>, Vectors) {
        let network = Network::new(graph);
        let mut state = zero_state(graph, 2);
        let passes: Vec<Pass> =
            observations().into_iter().map(|obs| network.forward(weights, obs, &mut state)).collect();
        let mut d_state = zero_state(graph, 2);
        let back = |(t, pass): (usize, Pass)| {
            let cols = pass.output().ncols();
            let d = Array2::from_shape_fn(pass.output().raw_dim(), |(r, c)| (1 + r * cols + c + t) as f32);
            network.backward(weights, pass, d, &mut d_state)
        };
        Derivatives::sum(graph, passes.into_iter().enumerate().rev().map(back).collect())
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        derivatives_are_right(&graph());
    }

    #[test]
    fn gradients_of_attention_agree_with_finite_differences() {
        derivatives_are_right(&attentive());
        let (mut graph, mut linear) = (Graph::new(5), linears());
        let after_prefix = Attention { heads: 2, kv_heads: 1, dim: 2, factor: 0.7, causal: true, context: 0 };
        let inputs = [12, 6, 6, 4, 4].map(|rows| linear(&mut graph, rows, 0));
        let tokens = graph.add(after_prefix, &inputs).expect("it fits");
        linear(&mut graph, 2, tokens);
        derivatives_are_right(&graph);
    }

    #[test]
    fn a_sequence_of_attention_equals_its_steps() {
        let graph = attentive();
        let (weights, network) = (Weights::of(&graph), Network::new(&graph));
        let mut states = [zero_state(&graph, 2), zero_state(&graph, 2)];
        let mut gradients = Vec::new();
        for at_once in [false, true] {
            let state = &mut states[usize::from(at_once)];
            let all = observations();
            let views: Vec<_> = all.iter().map(|obs| obs.view()).collect();
            let parts = if at_once { vec![ndarray::concatenate(ndarray::Axis(0), &views).expect("rows")] } else { all };
            let passes: Vec<Pass> = parts.into_iter().map(|obs| network.forward(&weights, obs, state)).collect();
            let outputs: Vec<f32> = passes.iter().flat_map(|pass| pass.output().iter().copied()).collect();
            let mut d_state = zero_state(&graph, 2);
            let back = |pass: Pass| {
                let d = pass.output().mapv(|y| y + 1.0);
                network.backward(&weights, pass, d, &mut d_state)
            };
            let (matrices, _) = Derivatives::sum(&graph, passes.into_iter().rev().map(back).collect());
            gradients.push((outputs, matrices.iter().flatten().copied().collect::<Vec<f32>>()));
        }
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + a.abs()));
        assert!(near(&gradients[0].0, &gradients[1].0) && near(&gradients[0].1, &gradients[1].1), "{gradients:?}");
        assert_eq!(states[0], states[1]);
    }

    #[test]
    fn denoising_gradients_agree_with_finite_differences() {
        derivatives_are_right(&iterative());
    }

    fn derivatives_are_right(graph: &Graph) {
        let weights = Weights::of(graph);
        let (matrices, vectors) = gradient(graph, &weights);
        let step = 2e-3;
        let compare = |exact: f32, change: &dyn Fn(&mut Weights, f32)| {
            let at = |d: f32| {
                let mut moved = weights.clone();
                change(&mut moved, d);
                loss(graph, &moved)
            };
            let numeric = (at(step) - at(-step)) / (2.0 * f64::from(step));
            let error = (numeric - f64::from(exact)).abs();
            assert!(error < 0.02 + 0.02 * numeric.abs(), "{numeric} against {exact}");
        };
        for (m, derivatives) in matrices.iter().enumerate() {
            for (i, exact) in derivatives.iter().enumerate() {
                compare(*exact, &|w, d| w.matrices[m].set(|values| values[i] += d));
            }
        }
        for (v, of_node) in vectors.iter().enumerate() {
            for (k, derivatives) in of_node.iter().enumerate() {
                for (i, exact) in derivatives.iter().enumerate() {
                    compare(*exact, &|w, d| w.vectors[v][k][i] += d);
                }
            }
        }
    }

    #[test]
    fn batches_agree_with_the_evaluator() {
        let graph = graph();
        let weights = Weights::of(&graph);
        let network = Network::new(&graph);
        let mut state = zero_state(&graph, 2);
        let mut evaluators = [crate::graph::Evaluator::new(&graph), crate::graph::Evaluator::new(&graph)];
        for obs in observations() {
            let pass = network.forward(&weights, obs.clone(), &mut state);
            for (sample, evaluator) in evaluators.iter_mut().enumerate() {
                let y = evaluator.step(&obs.row(sample).to_vec(), &mut |_, _| {});
                for (a, b) in pass.output().row(sample).iter().zip(y) {
                    assert!((a - b).abs() < 1e-4, "{a} against {b}");
                }
            }
        }
    }
}
