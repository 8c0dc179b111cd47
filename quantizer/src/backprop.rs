//! The network on batches, forwards and backwards.
//!
//! Values are matrices `[sample, element]`. A recurrent network runs over several steps; its gradient runs back through all of
//! them. The derivatives are checked against finite differences in the tests.

use actq_kernels::activations::{ROUND, TINY};
use actq_kernels::math::{self, Function};
use actq_kernels::recurrent::{gru_cell, lstm_cell};
use ndarray::{Array2, ArrayView1, ArrayView2, ArrayViewMut1, Axis, Zip, concatenate, linalg::general_mat_mul, s};

use crate::graph::{Graph, Matrix, NodeKind};

/// All that can be learned: the matrices of a graph and the vectors of its nodes. Gradients have the same form.
#[derive(Clone, Debug)]
pub struct Weights {
    /// As [`Graph::matrices`], `[rows, cols]`.
    pub matrices: Vec<Array2<f32>>,
    /// Per node its vectors: bias (linear, LSTM), weight and bias (LayerNorm), weight (RMSNorm), both biases (GRU).
    pub vectors: Vec<[Vec<f32>; 2]>,
}

impl Weights {
    /// The weights of a graph.
    pub fn of(graph: &Graph) -> Self {
        let array = |m: &Matrix| Array2::from_shape_fn((m.rows, m.cols), |(r, c)| m.data[r * m.cols + c]);
        let vectors = |kind: &NodeKind| match kind {
            NodeKind::Linear { bias, .. } | NodeKind::Lstm { bias, .. } => [bias.clone(), Vec::new()],
            NodeKind::LayerNorm { weight, bias, .. } => [weight.clone(), bias.clone()],
            NodeKind::RmsNorm { weight, .. } => [weight.clone(), Vec::new()],
            NodeKind::Gru { input_bias, state_bias, .. } => [input_bias.clone(), state_bias.clone()],
            _ => [Vec::new(), Vec::new()],
        };
        Self {
            matrices: graph.matrices.iter().map(array).collect(),
            vectors: graph.nodes.iter().map(|n| vectors(&n.kind)).collect(),
        }
    }

    /// Zeros of the same form.
    pub fn zeros_like(&self) -> Self {
        Self {
            matrices: self.matrices.iter().map(|m| Array2::zeros(m.raw_dim())).collect(),
            vectors: self.vectors.iter().map(|v| [vec![0.0; v[0].len()], vec![0.0; v[1].len()]]).collect(),
        }
    }

    /// Adds another set.
    pub fn add(&mut self, other: &Self) {
        for (a, b) in self.matrices.iter_mut().zip(&other.matrices) {
            *a += b;
        }
        for (a, b) in self.vectors.iter_mut().flatten().zip(other.vectors.iter().flatten()) {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        }
    }

    /// Puts the vectors into a graph's nodes.
    pub fn store_vectors(&self, graph: &mut Graph) {
        for (node, [first, second]) in graph.nodes.iter_mut().zip(&self.vectors) {
            match &mut node.kind {
                NodeKind::Linear { bias, .. } | NodeKind::Lstm { bias, .. } => bias.clone_from(first),
                NodeKind::LayerNorm { weight, bias, .. } => {
                    weight.clone_from(first);
                    bias.clone_from(second);
                }
                NodeKind::RmsNorm { weight, .. } => weight.clone_from(first),
                NodeKind::Gru { input_bias, state_bias, .. } => {
                    input_bias.clone_from(first);
                    state_bias.clone_from(second);
                }
                _ => {}
            }
        }
    }
}

/// Recurrent state of every node, `[sample, element]`: hidden and cell (empty where a node has none).
pub type State = Vec<[Array2<f32>; 2]>;

/// The zero state for a batch.
pub fn zero_state(graph: &Graph, batch: usize) -> State {
    graph.nodes.iter().map(|n| n.kind.state_lens().map(|len| Array2::zeros((batch, len)))).collect()
}

/// A batch's state from every sample's values in the order of [`Graph::state_len`]; `None`: zero.
pub fn start_state(graph: &Graph, starts: &[Option<Vec<f32>>]) -> State {
    let mut state = zero_state(graph, starts.len());
    for (sample, start) in starts.iter().enumerate() {
        let mut values = start.iter().flatten();
        for array in state.iter_mut().flatten() {
            array.row_mut(sample).iter_mut().zip(values.by_ref()).for_each(|(to, from)| *to = *from);
        }
    }
    state
}

/// What a node keeps for its backward pass.
#[derive(Debug)]
enum Saved {
    Nothing,
    /// The input of a matrix, as it entered the product.
    Input(Array2<f32>),
    /// Normalized values and the reciprocal deviation of each sample.
    Norm(Array2<f32>, Vec<f32>),
    /// What a recurrent cell saw.
    Cell(Box<Cell>),
}

/// A recurrent cell's inputs and inner values.
#[derive(Debug)]
struct Cell {
    /// Inputs of both products, as they entered them.
    x: Array2<f32>,
    h: Array2<f32>,
    /// Hidden and cell state before the step.
    previous: [Array2<f32>; 2],
    /// LSTM: all gates before their functions. GRU: the input's share of them.
    gates: Array2<f32>,
    /// LSTM: cell state after the step. GRU: the state's share of the gates.
    other: Array2<f32>,
}

/// Is shown the derivative by the output of a matrix product: matrix, node, whether of the state, derivative.
pub type See<'a> = dyn FnMut(usize, usize, bool, &Array2<f32>) + 'a;

/// One step's forward pass.
#[derive(Debug)]
pub struct Pass {
    /// The observation, then every node's output.
    pub values: Vec<Array2<f32>>,
    saved: Vec<Saved>,
}

impl Pass {
    /// The network's output.
    pub fn output(&self) -> &Array2<f32> {
        &self.values[self.values.len() - 1]
    }

    /// The vectors that a matrix of node `node` was multiplied with: of the input, or of the state.
    pub fn product_input(&self, node: usize, of_state: bool) -> Option<&Array2<f32>> {
        match &self.saved[node] {
            Saved::Input(x) => Some(x),
            Saved::Cell(cell) => Some(if of_state { &cell.h } else { &cell.x }),
            _ => None,
        }
    }
}

/// A network to run: its structure and how each matrix's input is rounded (activation magnitude; 0 = not at all).
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    /// The structure.
    pub graph: &'a Graph,
    /// Per matrix, or empty.
    pub x_max: &'a [u16],
}

/// Rounds every row to integers of its own scale, as the kernels do.
fn round_rows(x: &Array2<f32>, x_max: u16) -> Array2<f32> {
    let mut y = x.clone();
    if x_max > 0 {
        let top = f32::from(x_max);
        for mut row in y.rows_mut() {
            let amax = row.iter().fold(0f32, |m, v| m.max(v.abs()));
            if amax > TINY {
                let (inverse, scale) = (top / amax, amax / top);
                row.mapv_inplace(|v| ((v * inverse + ROUND) - ROUND) * scale);
            }
        }
    }
    y
}

fn add_rows(y: &mut Array2<f32>, bias: &[f32]) {
    for mut row in y.rows_mut() {
        row.iter_mut().zip(bias).for_each(|(y, b)| *y += b);
    }
}

/// `x W'`, rows contiguous (`dot` may choose another layout).
fn product(x: &Array2<f32>, w: &Array2<f32>) -> Array2<f32> {
    let mut y = Array2::zeros((x.nrows(), w.nrows()));
    general_mat_mul(1.0, x, &w.t(), 0.0, &mut y);
    y
}

impl Network<'_> {
    fn rounded(&self, matrix: usize, x: &Array2<f32>) -> Array2<f32> {
        round_rows(x, self.x_max.get(matrix).copied().unwrap_or(0))
    }

    /// One step for a batch of observations; `state` advances.
    pub fn forward(&self, weights: &Weights, obs: Array2<f32>, state: &mut State) -> Pass {
        let mut values = vec![obs];
        let mut saved = Vec::with_capacity(self.graph.nodes.len());
        for (i, node) in self.graph.nodes.iter().enumerate() {
            let x = &values[node.input];
            let [first, second] = &weights.vectors[i];
            let (y, keep) = match &node.kind {
                NodeKind::Normalize { mean, scale, pre_clip, clip } => {
                    let mut y = x.clone();
                    for mut row in y.rows_mut() {
                        for (y, (m, s)) in row.iter_mut().zip(mean.iter().zip(scale)) {
                            *y = ((y.clamp(-pre_clip, *pre_clip) - m) * s).clamp(-clip, *clip);
                        }
                    }
                    (y, Saved::Nothing)
                }
                NodeKind::Linear { matrix, .. } => {
                    let x = self.rounded(*matrix, x);
                    let mut y = product(&x, &weights.matrices[*matrix]);
                    add_rows(&mut y, first);
                    (y, Saved::Input(x))
                }
                NodeKind::Function(function) => {
                    let mut y = x.clone();
                    for mut row in y.rows_mut() {
                        function.apply(contiguous_mut(&mut row));
                    }
                    (y, Saved::Nothing)
                }
                NodeKind::LayerNorm { eps, .. } => normalized(x, first, second, *eps, true),
                NodeKind::RmsNorm { eps, .. } => normalized(x, first, &[], *eps, false),
                NodeKind::Add { with } => (x + &values[*with], Saved::Nothing),
                NodeKind::Concat(parts) => {
                    let views: Vec<ArrayView2<'_, f32>> = parts
                        .iter()
                        .map(|p| values[p.value].slice_axis(Axis(1), (p.from..p.from + p.len).into()))
                        .collect();
                    let joined = concatenate(Axis(1), &views).unwrap_or_default();
                    (joined.as_standard_layout().into_owned(), Saved::Nothing)
                }
                NodeKind::Lstm { input, state: w_hh, .. } => {
                    let [h, c] = &mut state[i];
                    let (x, hq) = (self.rounded(*input, x), self.rounded(*w_hh, h));
                    let mut gates = product(&x, &weights.matrices[*input]);
                    general_mat_mul(1.0, &hq, &weights.matrices[*w_hh].t(), 1.0, &mut gates);
                    add_rows(&mut gates, first);
                    let previous = [h.clone(), c.clone()];
                    for ((gates, mut c), mut h) in gates.rows().into_iter().zip(c.rows_mut()).zip(h.rows_mut()) {
                        lstm_cell(contiguous(&gates), contiguous_mut(&mut c), contiguous_mut(&mut h));
                    }
                    let cell = Cell { x, h: hq, previous, gates, other: c.clone() };
                    (h.clone(), Saved::Cell(Box::new(cell)))
                }
                NodeKind::Gru { input, state: w_hh, .. } => {
                    let [h, _] = &mut state[i];
                    let (x, hq) = (self.rounded(*input, x), self.rounded(*w_hh, h));
                    let mut a = product(&x, &weights.matrices[*input]);
                    add_rows(&mut a, first);
                    let mut b = product(&hq, &weights.matrices[*w_hh]);
                    add_rows(&mut b, second);
                    let previous = [h.clone(), Array2::default((0, 0))];
                    for ((a, b), mut h) in a.rows().into_iter().zip(b.rows()).zip(h.rows_mut()) {
                        gru_cell(contiguous(&a), contiguous(&b), contiguous_mut(&mut h));
                    }
                    (h.clone(), Saved::Cell(Box::new(Cell { x, h: hq, previous, gates: a, other: b })))
                }
            };
            values.push(y);
            saved.push(keep);
        }
        Pass { values, saved }
    }

    /// Steps back through one pass. `d_output` is the loss's derivative by the network's output; `d_state`, by the state after
    /// the step, becomes that by the state before it. `grads` gets the derivatives by the weights added. `see` is shown
    /// every matrix product.
    pub fn backward(
        &self,
        weights: &Weights,
        pass: &Pass,
        d_output: Array2<f32>,
        d_state: &mut State,
        grads: &mut Weights,
        see: &mut See<'_>,
    ) {
        let mut d_values: Vec<Option<Array2<f32>>> = vec![None; pass.values.len()];
        d_values[pass.values.len() - 1] = Some(d_output);
        for (i, node) in self.graph.nodes.iter().enumerate().rev() {
            let upstream = d_values[i + 1].take();
            let recurrent = matches!(node.kind, NodeKind::Lstm { .. } | NodeKind::Gru { .. });
            let mut dy = match upstream {
                Some(dy) => dy,
                None if recurrent => Array2::zeros(pass.values[i + 1].raw_dim()),
                None => continue,
            };
            let x = &pass.values[node.input];
            let mut give = |value: usize, d: Array2<f32>| match &mut d_values[value] {
                Some(sum) => *sum += &d,
                none => *none = Some(d),
            };
            match (&node.kind, &pass.saved[i]) {
                (NodeKind::Normalize { mean, scale, pre_clip, clip }, _) => {
                    for (mut d, x) in dy.rows_mut().into_iter().zip(x.rows()) {
                        for ((d, x), (m, s)) in d.iter_mut().zip(x).zip(mean.iter().zip(scale)) {
                            let inside = x.abs() < *pre_clip && ((x - m) * s).abs() < *clip;
                            *d = if inside { *d * s } else { 0.0 };
                        }
                    }
                    give(node.input, dy);
                }
                (NodeKind::Linear { matrix, .. }, Saved::Input(x)) => {
                    see(*matrix, i, false, &dy);
                    accumulate(&dy, x, &mut grads.matrices[*matrix]);
                    sum_rows(&dy, &mut grads.vectors[i][0]);
                    if node.input != 0 {
                        give(node.input, dy.dot(&weights.matrices[*matrix]));
                    }
                }
                (NodeKind::Function(function), _) => {
                    let derivative = derivative(*function);
                    Zip::from(&mut dy).and(x).and(&pass.values[i + 1]).for_each(|d, &x, &y| *d *= derivative(x, y));
                    give(node.input, dy);
                }
                (NodeKind::LayerNorm { .. } | NodeKind::RmsNorm { .. }, Saved::Norm(hat, inverse)) => {
                    let centered = matches!(node.kind, NodeKind::LayerNorm { .. });
                    let [d_weight, d_bias] = &mut grads.vectors[i];
                    if centered {
                        sum_rows(&dy, d_bias);
                    }
                    for ((mut d, hat), inverse) in dy.rows_mut().into_iter().zip(hat.rows()).zip(inverse) {
                        let n = hat.len() as f32;
                        let (mut mean, mut along) = (0.0, 0.0);
                        for (k, (d, hat)) in d.iter_mut().zip(hat).enumerate() {
                            d_weight[k] += *d * hat;
                            *d *= weights.vectors[i][0][k];
                            mean += *d / n;
                            along += *d * hat / n;
                        }
                        let mean = if centered { mean } else { 0.0 };
                        d.iter_mut().zip(hat).for_each(|(d, hat)| *d = (*d - mean - hat * along) * inverse);
                    }
                    give(node.input, dy);
                }
                (NodeKind::Add { with }, _) => {
                    give(*with, dy.clone());
                    give(node.input, dy);
                }
                (NodeKind::Concat(parts), _) => {
                    let mut from = 0;
                    for part in parts {
                        let mut d = Array2::zeros(pass.values[part.value].raw_dim());
                        d.slice_mut(s![.., part.from..part.from + part.len])
                            .assign(&dy.slice(s![.., from..from + part.len]));
                        give(part.value, d);
                        from += part.len;
                    }
                }
                (NodeKind::Lstm { hidden, input, state: w_hh, .. }, Saved::Cell(cell)) => {
                    let Cell { x, h, previous, gates, other: c } = &**cell;
                    let [d_h, d_c] = &mut d_state[i];
                    dy += &*d_h;
                    let mut d_gates = Array2::zeros(gates.raw_dim());
                    for sample in 0..dy.nrows() {
                        for k in 0..*hidden {
                            let gate = |g: usize| gates[[sample, g * hidden + k]];
                            let (ig, fg) = (math::sigmoid(gate(0)), math::sigmoid(gate(1)));
                            let (gg, og) = (math::tanh(gate(2)), math::sigmoid(gate(3)));
                            let tc = math::tanh(c[[sample, k]]);
                            let dh = dy[[sample, k]];
                            let dc = d_c[[sample, k]] + dh * og * (1.0 - tc * tc);
                            let mut set = |g: usize, v: f32| d_gates[[sample, g * hidden + k]] = v;
                            set(0, dc * gg * ig * (1.0 - ig));
                            set(1, dc * previous[1][[sample, k]] * fg * (1.0 - fg));
                            set(2, dc * ig * (1.0 - gg * gg));
                            set(3, dh * tc * og * (1.0 - og));
                            d_c[[sample, k]] = dc * fg;
                        }
                    }
                    see(*input, i, false, &d_gates);
                    see(*w_hh, i, true, &d_gates);
                    accumulate(&d_gates, x, &mut grads.matrices[*input]);
                    accumulate(&d_gates, h, &mut grads.matrices[*w_hh]);
                    sum_rows(&d_gates, &mut grads.vectors[i][0]);
                    *d_h = d_gates.dot(&weights.matrices[*w_hh]);
                    give(node.input, d_gates.dot(&weights.matrices[*input]));
                }
                (NodeKind::Gru { hidden, input, state: w_hh, .. }, Saved::Cell(cell)) => {
                    let Cell { x, h, previous, gates: a, other: b } = &**cell;
                    let [d_h, _] = &mut d_state[i];
                    dy += &*d_h;
                    let (mut d_a, mut d_b) = (Array2::zeros(a.raw_dim()), Array2::zeros(b.raw_dim()));
                    for sample in 0..dy.nrows() {
                        for k in 0..*hidden {
                            let at = |g: usize| [sample, g * hidden + k];
                            let r = math::sigmoid(a[at(0)] + b[at(0)]);
                            let z = math::sigmoid(a[at(1)] + b[at(1)]);
                            let n = math::tanh(a[at(2)] + r * b[at(2)]);
                            let dh = dy[[sample, k]];
                            let dn = dh * (1.0 - z) * (1.0 - n * n);
                            let dz = dh * (previous[0][[sample, k]] - n) * z * (1.0 - z);
                            let dr = dn * b[at(2)] * r * (1.0 - r);
                            for (g, da, db) in [(0, dr, dr), (1, dz, dz), (2, dn, dn * r)] {
                                d_a[at(g)] = da;
                                d_b[at(g)] = db;
                            }
                            d_h[[sample, k]] = dh * z;
                        }
                    }
                    see(*input, i, false, &d_a);
                    see(*w_hh, i, true, &d_b);
                    accumulate(&d_a, x, &mut grads.matrices[*input]);
                    accumulate(&d_b, h, &mut grads.matrices[*w_hh]);
                    let [first, second] = &mut grads.vectors[i];
                    sum_rows(&d_a, first);
                    sum_rows(&d_b, second);
                    *d_h += &d_b.dot(&weights.matrices[*w_hh]);
                    give(node.input, d_a.dot(&weights.matrices[*input]));
                }
                _ => {}
            }
        }
    }
}

/// A row as a slice. Every value is made in standard layout.
fn contiguous<'a>(row: &'a ArrayView1<'_, f32>) -> &'a [f32] {
    row.as_slice().expect("rows are contiguous")
}

/// As [`contiguous`].
fn contiguous_mut<'a>(row: &'a mut ArrayViewMut1<'_, f32>) -> &'a mut [f32] {
    row.as_slice_mut().expect("rows are contiguous")
}

/// `grad += dy' x`
fn accumulate(dy: &Array2<f32>, x: &Array2<f32>, grad: &mut Array2<f32>) {
    general_mat_mul(1.0, &dy.t(), x, 1.0, grad);
}

fn sum_rows(dy: &Array2<f32>, grad: &mut [f32]) {
    for row in dy.rows() {
        grad.iter_mut().zip(row).for_each(|(g, d)| *g += d);
    }
}

fn normalized(x: &Array2<f32>, weight: &[f32], bias: &[f32], eps: f32, centered: bool) -> (Array2<f32>, Saved) {
    let mut hat = x.clone();
    let mut y = x.clone();
    let mut inverses = Vec::with_capacity(x.nrows());
    for (mut hat, mut y) in hat.rows_mut().into_iter().zip(y.rows_mut()) {
        let n = hat.len() as f32;
        let mean = if centered { hat.sum() / n } else { 0.0 };
        let square = hat.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n;
        let inverse = 1.0 / (square + eps).sqrt();
        for (k, (hat, y)) in hat.iter_mut().zip(y.iter_mut()).enumerate() {
            *hat = (*hat - mean) * inverse;
            *y = *hat * weight[k] + bias.get(k).copied().unwrap_or(0.0);
        }
        inverses.push(inverse);
    }
    (y, Saved::Norm(hat, inverses))
}

/// The derivative of a function at `x`, where its value is `y`.
fn derivative(function: Function) -> fn(f32, f32) -> f32 {
    match function {
        Function::Relu => |x, _| if x > 0.0 { 1.0 } else { 0.0 },
        Function::Elu => |x, y| if x > 0.0 { 1.0 } else { y + 1.0 },
        Function::Silu => |x, y| {
            let s = math::sigmoid(x);
            s + y * (1.0 - s)
        },
        Function::Gelu => |x, y| {
            // Phi(x) + x phi(x); Phi is y / x away from zero.
            let phi = 0.398_942_3 * math::exp(-0.5 * x * x);
            let cumulative = if x.abs() > 1e-2 { y / x } else { 0.5 + 0.398_942_3 * x };
            cumulative + x * phi
        },
        Function::GeluTanh => |x, y| {
            let s = math::sigmoid(1.595_769 * (x + 0.044_715 * x * x * x));
            s + y * (1.0 - s) * 1.595_769 * (1.0 + 0.134_145 * x * x)
        },
        Function::Tanh => |_, y| 1.0 - y * y,
        Function::Sigmoid => |_, y| y * (1.0 - y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Node, Part};
    use crate::random::Random;

    fn random(len: usize, seed: &mut Random) -> Vec<f32> {
        (0..len).map(|_| seed.unit()).collect()
    }

    /// A graph with every kind of node.
    fn graph() -> Graph {
        let mut seed = Random(11);
        let mut graph = Graph::new(5);
        let mut push = |kind: NodeKind, input: usize, matrices: &[(usize, usize)]| {
            for &(rows, cols) in matrices {
                let data = random(rows * cols, &mut seed).iter().map(|w| 0.6 * w).collect();
                graph.matrices.push(Matrix { name: "m".into(), rows, cols, data });
            }
            let len = kind.output_len(&graph.matrices, graph.len_of(input));
            graph.nodes.push(Node { kind, input, len });
            graph.output()
        };
        let vector = |n: usize, seed: u64| random(n, &mut Random(seed));
        let weight = |n: usize, seed: u64| vector(n, seed).iter().map(|v| 1.0 + 0.3 * v).collect::<Vec<_>>();
        let normal =
            push(NodeKind::Normalize { mean: vector(5, 1), scale: weight(5, 2), pre_clip: 10.0, clip: 3.0 }, 0, &[]);
        let mut last = push(NodeKind::Linear { matrix: 0, bias: vector(6, 3) }, normal, &[(6, 5)]);
        let kept = last;
        for function in Function::ALL {
            last = push(NodeKind::Linear { matrix: graph_matrix(function), bias: vector(6, 4) }, last, &[(6, 6)]);
            last = push(NodeKind::Function(function), last, &[]);
            last = push(NodeKind::Add { with: kept }, last, &[]);
        }
        last = push(NodeKind::LayerNorm { weight: weight(6, 5), bias: vector(6, 6), eps: 1e-3 }, last, &[]);
        let parts = vec![Part { value: last, from: 1, len: 4 }, Part { value: normal, from: 0, len: 3 }];
        last = push(NodeKind::Concat(parts), 0, &[]);
        last = push(NodeKind::RmsNorm { weight: weight(7, 7), eps: 1e-3 }, last, &[]);
        last = push(NodeKind::Lstm { hidden: 4, input: 8, state: 9, bias: vector(16, 8) }, last, &[(16, 7), (16, 4)]);
        last = push(
            NodeKind::Gru { hidden: 3, input: 10, state: 11, input_bias: vector(9, 9), state_bias: vector(9, 10) },
            last,
            &[(9, 4), (9, 3)],
        );
        push(NodeKind::Linear { matrix: 12, bias: vector(2, 11) }, last, &[(2, 3)]);
        graph
    }

    fn graph_matrix(function: Function) -> usize {
        1 + Function::ALL.iter().position(|f| *f == function).unwrap_or_default()
    }

    const STEPS: usize = 3;

    fn observations() -> Vec<Array2<f32>> {
        let mut seed = Random(5);
        (0..STEPS).map(|_| Array2::from_shape_fn((2, 5), |_| seed.unit())).collect()
    }

    /// A loss over all steps with different weights on each output.
    fn loss(graph: &Graph, weights: &Weights) -> f64 {
        let network = Network { graph, x_max: &[] };
        let mut state = zero_state(graph, 2);
        let mut sum = 0.0;
        for (t, obs) in observations().into_iter().enumerate() {
            let pass = network.forward(weights, obs, &mut state);
            sum += pass.output().iter().enumerate().map(|(i, y)| f64::from(*y) * (1 + i + t) as f64).sum::<f64>();
        }
        sum
    }

    fn gradient(graph: &Graph, weights: &Weights) -> Weights {
        let network = Network { graph, x_max: &[] };
        let mut state = zero_state(graph, 2);
        let passes: Vec<Pass> =
            observations().into_iter().map(|obs| network.forward(weights, obs, &mut state)).collect();
        let mut grads = weights.zeros_like();
        let mut d_state = zero_state(graph, 2);
        for (t, pass) in passes.iter().enumerate().rev() {
            let cols = pass.output().ncols();
            let d = Array2::from_shape_fn(pass.output().raw_dim(), |(r, c)| (1 + r * cols + c + t) as f32);
            network.backward(weights, pass, d, &mut d_state, &mut grads, &mut |_, _, _, _| {});
        }
        grads
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        let graph = graph();
        let weights = Weights::of(&graph);
        let grads = gradient(&graph, &weights);
        let step = 2e-3;
        let compare = |exact: f32, change: &dyn Fn(&mut Weights, f32)| {
            let at = |d: f32| {
                let mut moved = weights.clone();
                change(&mut moved, d);
                loss(&graph, &moved)
            };
            let numeric = (at(step) - at(-step)) / (2.0 * f64::from(step));
            let error = (numeric - f64::from(exact)).abs();
            assert!(error < 0.02 + 0.02 * numeric.abs(), "{numeric} against {exact}");
        };
        for m in 0..weights.matrices.len() {
            for i in 0..weights.matrices[m].len() {
                let at = (i / weights.matrices[m].ncols(), i % weights.matrices[m].ncols());
                compare(grads.matrices[m][at], &|w, d| w.matrices[m][at] += d);
            }
        }
        for v in 0..weights.vectors.len() {
            for k in 0..2 {
                for i in 0..weights.vectors[v][k].len() {
                    compare(grads.vectors[v][k][i], &|w, d| w.vectors[v][k][i] += d);
                }
            }
        }
    }

    #[test]
    fn a_batch_gives_what_the_evaluator_gives() {
        let graph = graph();
        let weights = Weights::of(&graph);
        let network = Network { graph: &graph, x_max: &[] };
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
