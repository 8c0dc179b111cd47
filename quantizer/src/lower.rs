//! From the graph's values to regions of the arena: which operation reads and writes where.
//!
//! Every value gets a buffer. Elementwise operations overwrite their input's buffer where nothing needs it any more. The arena
//! holds the recurrent state, the observation, the values, which share memory by their lifetimes, first fit, the last action, and
//! the work area. Buffers are placed in the order in which they are written, each as low as it fits: so none leaves a gap, and what
//! a step has written always is the begin of the arena, as the image's check wants it.

use actq_kernels::activations::max_prepared_words;
use actq_kernels::image::Region;
use actq_kernels::math::Function;
use anyhow::{Result, ensure};

use crate::graph::{Graph, Node, NodeKind, ValueId};

/// An operation over `R`: buffers while lowering, regions of the arena afterwards.
#[derive(Clone, Debug)]
pub struct Step<R> {
    /// What it does.
    pub kind: StepKind,
    /// Output, or the operand of an operation in place.
    pub dst: R,
    /// First source.
    pub src: Option<R>,
    /// Cell state or the state's gates.
    pub extra: Option<R>,
}

/// The operations of an image. `node` indexes [`Graph::nodes`], whose constants the writer takes.
#[derive(Clone, Copy, Debug)]
pub enum StepKind {
    /// Normalization with the constants of a node.
    Normalize {
        /// The node.
        node: usize,
    },
    /// A matrix product.
    Linear {
        /// The node.
        node: usize,
        /// Which of the node's products.
        product: Product,
        /// Add to the destination.
        accumulate: bool,
    },
    /// Elementwise, in place.
    Function(Function),
    /// In place.
    LayerNorm {
        /// The node.
        node: usize,
    },
    /// In place.
    RmsNorm {
        /// The node.
        node: usize,
    },
    /// `dst += src`
    Add,
    /// `dst = src`
    Copy,
    /// LSTM cell
    LstmCell,
    /// GRU cell
    GruCell,
}

/// Which of a node's matrix products.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Product {
    /// With the node's input: W or W_ih.
    Input,
    /// With the node's state: W_hh.
    State,
}

/// The matrix and the bias (empty: none) of a product of `node`.
pub fn product(node: &Node, product: Product) -> Option<(usize, &[f32])> {
    Some(match (&node.kind, product) {
        (NodeKind::Linear { matrix, bias }, Product::Input) => (*matrix, bias),
        (NodeKind::Lstm { input, bias, .. }, Product::Input) => (*input, bias),
        (NodeKind::Lstm { state, .. }, Product::State) => (*state, &[]),
        (NodeKind::Gru { input, input_bias, .. }, Product::Input) => (*input, input_bias),
        (NodeKind::Gru { state, state_bias, .. }, Product::State) => (*state, state_bias),
        _ => return None,
    })
}

/// The arena and the operations in it.
#[derive(Debug)]
pub struct Program {
    /// The operations in order.
    pub steps: Vec<Step<Region>>,
    /// Zeroed by a reset.
    pub state: Region,
    /// The observation.
    pub observation: Region,
    /// The network's output.
    pub output: Region,
    /// The action.
    pub action: Region,
    /// Prepared activations.
    pub work: Region,
    /// Words of the arena.
    pub words: usize,
}

/// Part of a buffer.
#[derive(Clone, Copy, Debug)]
struct Slice {
    buffer: usize,
    offset: usize,
    len: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lifetime {
    /// Between the first and the last operation that names it.
    Step,
    /// From the first operation that names it on: the output, a chunk of which is played over several steps.
    Output,
    /// In a place of its own, written before the first operation.
    Observation,
    /// In a place of its own, beyond the step, and zeroed by a reset.
    State,
}

struct Buffer {
    len: usize,
    lifetime: Lifetime,
}

struct Lowering<'g> {
    graph: &'g Graph,
    steps: Vec<Step<Slice>>,
    buffers: Vec<Buffer>,
    /// The buffer of each value.
    place: Vec<usize>,
    /// How many nodes still read each value; the network's output counts as one more.
    readers: Vec<usize>,
}

/// Lowers `graph` for actions of `act_len` values and weights with scale groups of `group` columns.
pub fn lower(graph: &Graph, act_len: usize, group: usize) -> Result<Program> {
    let values = graph.nodes.len() + 1;
    let mut readers = vec![0; values];
    readers[graph.output()] = 1;
    for node in &graph.nodes {
        for value in reads(node) {
            readers[value] += 1;
        }
    }
    let mut lowering = Lowering { graph, steps: Vec::new(), buffers: Vec::new(), place: Vec::new(), readers };
    let observation = lowering.buffer(graph.obs_len, Lifetime::Observation);
    lowering.place.push(observation);
    for (i, node) in graph.nodes.iter().enumerate() {
        let place = lowering.node(i, node);
        lowering.place.push(place);
    }
    let output = lowering.private(graph.output());
    lowering.buffers[output].lifetime = Lifetime::Output;
    lowering.assign(observation, output, act_len, group)
}

/// The values that a node reads.
fn reads(node: &Node) -> Vec<ValueId> {
    match &node.kind {
        NodeKind::Concat(parts) => parts.iter().map(|p| p.value).collect(),
        NodeKind::Add { with } => vec![node.input, *with],
        _ => vec![node.input],
    }
}

impl Lowering<'_> {
    fn buffer(&mut self, len: usize, lifetime: Lifetime) -> usize {
        self.buffers.push(Buffer { len, lifetime });
        self.buffers.len() - 1
    }

    fn whole(&self, buffer: usize) -> Slice {
        Slice { buffer, offset: 0, len: self.buffers[buffer].len }
    }

    fn emit(&mut self, kind: StepKind, dst: Slice, src: Option<Slice>, extra: Option<Slice>) {
        self.steps.push(Step { kind, dst, src, extra });
    }

    /// A buffer with `value` that may be overwritten: the value's own where this reader is the last, else a copy.
    fn private(&mut self, value: ValueId) -> usize {
        let place = self.place[value];
        if self.readers[value] <= 1 && self.buffers[place].lifetime == Lifetime::Step {
            return place;
        }
        let copy = self.buffer(self.buffers[place].len, Lifetime::Step);
        self.emit(StepKind::Copy, self.whole(copy), Some(self.whole(place)), None);
        copy
    }

    fn node(&mut self, i: usize, node: &Node) -> usize {
        let place = match &node.kind {
            NodeKind::Normalize { .. } => {
                let dst = self.buffer(node.len, Lifetime::Step);
                let src = self.whole(self.place[node.input]);
                self.emit(StepKind::Normalize { node: i }, self.whole(dst), Some(src), None);
                dst
            }
            NodeKind::Linear { .. } => {
                let dst = self.buffer(node.len, Lifetime::Step);
                self.linear(i, Product::Input, self.place[node.input], dst, false);
                dst
            }
            NodeKind::Function(function) => self.in_place(node.input, StepKind::Function(*function)),
            NodeKind::LayerNorm { .. } => self.in_place(node.input, StepKind::LayerNorm { node: i }),
            NodeKind::RmsNorm { .. } => self.in_place(node.input, StepKind::RmsNorm { node: i }),
            NodeKind::Add { with } => {
                let dst = self.private(node.input);
                let with = self.whole(self.place[*with]);
                self.emit(StepKind::Add, self.whole(dst), Some(with), None);
                dst
            }
            NodeKind::Concat(parts) => {
                let dst = self.buffer(node.len, Lifetime::Step);
                let mut offset = 0;
                for part in parts {
                    let to = Slice { buffer: dst, offset, len: part.len };
                    let from = Slice { buffer: self.place[part.value], offset: part.from, len: part.len };
                    self.emit(StepKind::Copy, to, Some(from), None);
                    offset += part.len;
                }
                dst
            }
            NodeKind::Lstm { hidden, .. } => {
                let h = self.buffer(*hidden, Lifetime::State);
                let c = self.buffer(*hidden, Lifetime::State);
                let gates = self.buffer(4 * hidden, Lifetime::Step);
                self.linear(i, Product::Input, self.place[node.input], gates, false);
                self.linear(i, Product::State, h, gates, true);
                self.emit(StepKind::LstmCell, self.whole(h), Some(self.whole(gates)), Some(self.whole(c)));
                h
            }
            NodeKind::Gru { hidden, .. } => {
                let h = self.buffer(*hidden, Lifetime::State);
                let input = self.buffer(3 * hidden, Lifetime::Step);
                let state = self.buffer(3 * hidden, Lifetime::Step);
                self.linear(i, Product::Input, self.place[node.input], input, false);
                self.linear(i, Product::State, h, state, false);
                self.emit(StepKind::GruCell, self.whole(h), Some(self.whole(input)), Some(self.whole(state)));
                h
            }
        };
        for value in reads(node) {
            self.readers[value] -= 1;
        }
        place
    }

    fn linear(&mut self, node: usize, product: Product, src: usize, dst: usize, accumulate: bool) {
        let kind = StepKind::Linear { node, product, accumulate };
        self.emit(kind, self.whole(dst), Some(self.whole(src)), None);
    }

    fn in_place(&mut self, input: ValueId, kind: StepKind) -> usize {
        let dst = self.private(input);
        self.emit(kind, self.whole(dst), None, None);
        dst
    }

    /// Gives every buffer its place.
    fn assign(self, observation: usize, output: usize, act_len: usize, group: usize) -> Result<Program> {
        let mut offsets = vec![0; self.buffers.len()];
        let mut top = 0;
        let mut state_len = 0;
        for lifetime in [Lifetime::State, Lifetime::Observation] {
            for (offset, buffer) in offsets.iter_mut().zip(&self.buffers).filter(|(_, b)| b.lifetime == lifetime) {
                *offset = top;
                top += buffer.len;
            }
            if lifetime == Lifetime::State {
                state_len = top;
            }
        }
        let mut ends = vec![top];
        let mut placed: Vec<(usize, (usize, usize))> = Vec::new();
        for (buffer, life) in self.lifetimes() {
            let len = self.buffers[buffer].len;
            let taken = |offset: usize| {
                let clash = |&&(other, span): &&(usize, (usize, usize))| {
                    let meets = span.0 <= life.1 && life.0 <= span.1;
                    meets && offset < offsets[other] + self.buffers[other].len && offsets[other] < offset + len
                };
                placed.iter().find(clash).map(|&(other, _)| offsets[other] + self.buffers[other].len)
            };
            let mut offset = top;
            while let Some(next) = taken(offset) {
                offset = next;
            }
            offsets[buffer] = offset;
            ends.push(offset + len);
            placed.push((buffer, life));
        }
        let action = Region { offset: ends.into_iter().max().unwrap_or(top), len: act_len };
        let work_offset = action.offset + action.len;
        let work_len = self.graph.matrices.iter().map(|m| max_prepared_words(m.cols, group)).max().unwrap_or(0);
        let words = work_offset + work_len;
        ensure!(
            words <= usize::from(u16::MAX),
            "the policy needs {words} words of scratch memory, 65535 are supported"
        );
        let region = |s: Slice| Region { offset: offsets[s.buffer] + s.offset, len: s.len };
        let whole = |buffer: usize| Region { offset: offsets[buffer], len: self.buffers[buffer].len };
        let steps = self.steps.iter().map(|step| Step {
            kind: step.kind,
            dst: region(step.dst),
            src: step.src.map(region),
            extra: step.extra.map(region),
        });
        Ok(Program {
            steps: steps.collect(),
            state: Region { offset: 0, len: state_len },
            observation: whole(observation),
            output: whole(output),
            action,
            work: Region { offset: work_offset, len: work_len },
            words,
        })
    }

    /// First and last operation during which each value's buffer is needed, in order of the first.
    fn lifetimes(&self) -> Vec<(usize, (usize, usize))> {
        let mut lives: Vec<(usize, (usize, usize))> = Vec::new();
        for (at, step) in self.steps.iter().enumerate() {
            for slice in [Some(step.dst), step.src, step.extra].into_iter().flatten() {
                let last = match self.buffers[slice.buffer].lifetime {
                    Lifetime::Step => at,
                    Lifetime::Output => usize::MAX,
                    Lifetime::Observation | Lifetime::State => continue,
                };
                match lives.iter_mut().find(|(buffer, _)| *buffer == slice.buffer) {
                    Some((_, life)) => life.1 = last,
                    None => lives.push((slice.buffer, (at, last))),
                }
            }
        }
        lives
    }
}
