//! The network as a list of nodes over values, and its evaluation in f32.

use actq_kernels::math::Function;

/// 0 is the observation; `i + 1` is the output of node `i`.
pub type ValueId = usize;

/// A weight matrix, row-major, rows are outputs.
#[derive(Clone, Debug)]
pub struct Matrix {
    /// The tensor's name.
    pub name: String,
    /// Outputs.
    pub rows: usize,
    /// Inputs.
    pub cols: usize,
    /// `rows * cols` weights.
    pub data: Vec<f32>,
}

/// A node: what it computes, from which value, and how long its output is.
#[derive(Clone, Debug)]
pub struct Node {
    /// The operation.
    pub kind: NodeKind,
    /// Its input (unused by [`NodeKind::Concat`]).
    pub input: ValueId,
    /// Length of its output.
    pub len: usize,
}

/// A run of a value's elements.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The value.
    pub value: ValueId,
    /// First element.
    pub from: usize,
    /// Elements.
    pub len: usize,
}

/// The operations. `matrix`, `input` and `state` index [`Graph::matrices`].
#[derive(Clone, Debug)]
pub enum NodeKind {
    /// `clamp((clamp(x, ±pre_clip) - mean) * scale, ±clip)`
    Normalize {
        /// Means.
        mean: Vec<f32>,
        /// Factors.
        scale: Vec<f32>,
        /// Limit before, or infinity.
        pre_clip: f32,
        /// Limit after, or infinity.
        clip: f32,
    },
    /// `W x + b`
    Linear {
        /// The matrix.
        matrix: usize,
        /// One value per row.
        bias: Vec<f32>,
    },
    /// Elementwise.
    Function(Function),
    /// torch's LayerNorm
    LayerNorm {
        /// Weights.
        weight: Vec<f32>,
        /// Biases.
        bias: Vec<f32>,
        /// Added to the variance.
        eps: f32,
    },
    /// `x / sqrt(mean(x^2) + eps) * weight`
    RmsNorm {
        /// Weights.
        weight: Vec<f32>,
        /// Added to the mean square.
        eps: f32,
    },
    /// Sum with another value.
    Add {
        /// The other value.
        with: ValueId,
    },
    /// Parts of values behind each other.
    Concat(Vec<Part>),
    /// torch's LSTM, one layer, one step.
    Lstm {
        /// Length of the state.
        hidden: usize,
        /// W_ih
        input: usize,
        /// W_hh
        state: usize,
        /// b_ih + b_hh
        bias: Vec<f32>,
    },
    /// torch's GRU, one layer, one step.
    Gru {
        /// Length of the state.
        hidden: usize,
        /// W_ih
        input: usize,
        /// W_hh
        state: usize,
        /// b_ih
        input_bias: Vec<f32>,
        /// b_hh
        state_bias: Vec<f32>,
    },
}

impl NodeKind {
    /// Length of the output for an input of `len` values.
    pub fn output_len(&self, matrices: &[Matrix], len: usize) -> usize {
        match self {
            Self::Linear { matrix, .. } => matrices[*matrix].rows,
            Self::Lstm { hidden, .. } | Self::Gru { hidden, .. } => *hidden,
            Self::Concat(parts) => parts.iter().map(|p| p.len).sum(),
            _ => len,
        }
    }

    /// Lengths of the hidden and of the cell state; 0 where there is none.
    pub fn state_lens(&self) -> [usize; 2] {
        match self {
            Self::Lstm { hidden, .. } => [*hidden, *hidden],
            Self::Gru { hidden, .. } => [*hidden, 0],
            _ => [0, 0],
        }
    }
}

/// A network.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Length of an observation.
    pub obs_len: usize,
    /// The weight matrices; each is quantized once, however many nodes use it.
    pub matrices: Vec<Matrix>,
    /// The nodes in the order of evaluation; the last one's output is the network's.
    pub nodes: Vec<Node>,
}

impl Graph {
    /// A network without nodes.
    pub fn new(obs_len: usize) -> Self {
        Self { obs_len, matrices: Vec::new(), nodes: Vec::new() }
    }

    /// The value that the last node gives.
    pub fn output(&self) -> ValueId {
        self.nodes.len()
    }

    /// Length of a value.
    pub fn len_of(&self, value: ValueId) -> usize {
        if value == 0 { self.obs_len } else { self.nodes[value - 1].len }
    }

    /// Values of the recurrent state: of each node in order its hidden state, then its cell state. An image keeps them in the
    /// same order.
    pub fn state_len(&self) -> usize {
        self.nodes.iter().flat_map(|node| node.kind.state_lens()).sum()
    }

    /// Weights and biases and all other constants, counted as the f32 policy stores them.
    pub fn parameters(&self) -> usize {
        let constants: usize = self
            .nodes
            .iter()
            .map(|node| match &node.kind {
                NodeKind::Normalize { mean, scale, .. } => mean.len() + scale.len(),
                NodeKind::Linear { bias, .. } => bias.len(),
                NodeKind::LayerNorm { weight, bias, .. } => weight.len() + bias.len(),
                NodeKind::RmsNorm { weight, .. } => weight.len(),
                NodeKind::Lstm { bias, .. } => 2 * bias.len(),
                NodeKind::Gru { input_bias, state_bias, .. } => input_bias.len() + state_bias.len(),
                NodeKind::Function(_) | NodeKind::Add { .. } | NodeKind::Concat(_) => 0,
            })
            .sum();
        constants + self.weights()
    }

    /// Elements of all weight matrices.
    pub fn weights(&self) -> usize {
        self.matrices.iter().map(|m| m.data.len()).sum()
    }
}

/// Evaluates a graph in f32, step by step, with its recurrent state.
#[derive(Debug)]
pub struct Evaluator<'g> {
    graph: &'g Graph,
    /// Hidden and cell state of each node; empty where it has none.
    state: Vec<[Vec<f32>; 2]>,
}

impl<'g> Evaluator<'g> {
    /// Starts from the zero state.
    pub fn new(graph: &'g Graph) -> Self {
        let mut evaluator = Self { graph, state: Vec::new() };
        evaluator.reset();
        evaluator
    }

    /// Zeroes the recurrent state.
    pub fn reset(&mut self) {
        self.start(None);
    }

    /// Sets the recurrent state, in the order of [`Graph::state_len`]; `None`: zero.
    pub fn start(&mut self, state: Option<&[f32]>) {
        self.state = self.graph.nodes.iter().map(|node| node.kind.state_lens().map(|len| vec![0.0; len])).collect();
        let values = self.state.iter_mut().flatten().flatten();
        values.zip(state.unwrap_or_default()).for_each(|(to, from)| *to = *from);
    }

    /// The network's output for one observation of the graph's length. `tap` sees every matrix's index and input vector.
    pub fn step(&mut self, obs: &[f32], tap: &mut dyn FnMut(usize, &[f32])) -> Vec<f32> {
        let matrices = &self.graph.matrices;
        let mut values: Vec<Vec<f32>> = vec![obs.to_vec()];
        for (node, state) in self.graph.nodes.iter().zip(&mut self.state) {
            let x = &values[node.input];
            let y = match &node.kind {
                NodeKind::Normalize { mean, scale, pre_clip, clip } => x
                    .iter()
                    .zip(mean.iter().zip(scale))
                    .map(|(x, (m, s))| ((x.clamp(-pre_clip, *pre_clip) - m) * s).clamp(-clip, *clip))
                    .collect(),
                NodeKind::Linear { matrix, bias } => {
                    tap(*matrix, x);
                    affine(&matrices[*matrix], x, bias)
                }
                NodeKind::Function(function) => {
                    let mut y = x.clone();
                    function.apply(&mut y);
                    y
                }
                NodeKind::LayerNorm { weight, bias, eps } => {
                    let n = x.len() as f32;
                    let mean = x.iter().sum::<f32>() / n;
                    let inverse = 1.0 / (x.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n + eps).sqrt();
                    x.iter().zip(weight.iter().zip(bias)).map(|(x, (w, b))| (x - mean) * inverse * w + b).collect()
                }
                NodeKind::RmsNorm { weight, eps } => {
                    let inverse = 1.0 / (x.iter().map(|v| v * v).sum::<f32>() / x.len() as f32 + eps).sqrt();
                    x.iter().zip(weight).map(|(x, w)| x * inverse * w).collect()
                }
                NodeKind::Add { with } => x.iter().zip(&values[*with]).map(|(a, b)| a + b).collect(),
                NodeKind::Concat(parts) => {
                    parts.iter().flat_map(|p| values[p.value][p.from..p.from + p.len].iter().copied()).collect()
                }
                NodeKind::Lstm { input, state: w_hh, bias, .. } => {
                    let [h, c] = state;
                    tap(*input, x);
                    tap(*w_hh, h);
                    let gates = affine(&matrices[*w_hh], h, &affine(&matrices[*input], x, bias));
                    actq_kernels::recurrent::lstm_cell(&gates, c, h);
                    h.clone()
                }
                NodeKind::Gru { input, state: w_hh, input_bias, state_bias, .. } => {
                    let [h, _] = state;
                    tap(*input, x);
                    tap(*w_hh, h);
                    let a = affine(&matrices[*input], x, input_bias);
                    let b = affine(&matrices[*w_hh], h, state_bias);
                    actq_kernels::recurrent::gru_cell(&a, &b, h);
                    h.clone()
                }
            };
            values.push(y);
        }
        values.pop().unwrap_or_default()
    }
}

/// `W x + start`
fn affine(matrix: &Matrix, x: &[f32], start: &[f32]) -> Vec<f32> {
    let rows = matrix.data.chunks_exact(matrix.cols);
    rows.zip(start).map(|(row, start)| start + row.iter().zip(x).map(|(w, x)| w * x).sum::<f32>()).collect()
}
