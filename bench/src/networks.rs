//! Networks of drawn weights, for measurements and properties.

use std::path::PathBuf;

use actq::contract::ActionContract;
use actq::graph::ops::{Concat, Linear, Span};
use actq::graph::{Graph, NodeKind, ValueId, WeightMatrix};
use actq::methods::scale::round_to_nearest;
use actq::methods::{Activations, Outcome};
use actq::policy::Policy;
use actq::random::Random;
use actq_kernels::Width;
use actq_kernels::image::Kind;
use anyhow::Result;

/// A network under construction: parts of the observation go through one operation each.
#[derive(Debug)]
pub struct Builder {
    /// So far.
    pub graph: Graph,
    outcomes: Vec<Outcome>,
    random: Random,
}

impl Builder {
    /// A network without operations.
    pub fn new(observation: usize) -> Self {
        Self { graph: Graph::new(observation), outcomes: Vec::new(), random: Random(2) }
    }

    /// An operation on values; gives its output.
    pub fn node(&mut self, kind: impl Into<NodeKind>, inputs: &[ValueId]) -> Result<ValueId> {
        self.graph.add(kind, inputs)
    }

    /// The first values of the observation.
    pub fn part(&mut self, len: usize) -> Result<ValueId> {
        self.node(Concat(vec![Span { from: 0, len }]), &[0])
    }

    /// Values between -1 and 1.
    pub fn values(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.random.unit()).collect()
    }

    /// A matrix that keeps the variance of its input, with a width for each row; rows without one have no bits.
    pub fn matrix(
        &mut self,
        rows: usize,
        cols: usize,
        activations: Activations,
        widths: &[Option<Width>],
        group: usize,
    ) -> Result<usize> {
        let data = self.values(rows * cols).iter().map(|w| w * (3.0 / cols as f32).sqrt()).collect();
        let matrix = WeightMatrix { name: format!("{rows}x{cols}"), rows, cols, data };
        let mut used: Vec<Width> = widths.iter().copied().flatten().collect();
        used.sort();
        used.dedup();
        let mut quantized = round_to_nearest(&matrix, used[0], group);
        quantized.widths = widths.to_vec();
        for &width in &used[1..] {
            let other = round_to_nearest(&matrix, width, group);
            for (row, _) in widths.iter().enumerate().filter(|(_, w)| **w == Some(width)) {
                quantized.scales[row] = other.scales[row];
                quantized.codes[row * cols..][..cols].copy_from_slice(&other.codes[row * cols..][..cols]);
                let groups = quantized.groups();
                quantized.group_scales[row * groups..][..groups]
                    .copy_from_slice(&other.group_scales[row * groups..][..groups]);
            }
        }
        self.outcomes.push(Outcome::new(&matrix, quantized, None, activations)?);
        self.graph.add_matrix(matrix)
    }

    /// A product with a part of the observation, with drawn biases or none.
    pub fn linear(
        &mut self,
        shape: (usize, usize),
        activations: Activations,
        widths: impl Fn(usize) -> Option<Width>,
        group: usize,
        bias: bool,
    ) -> Result<ValueId> {
        let (rows, cols) = shape;
        let input = self.part(cols)?;
        let matrix = self.matrix(rows, cols, activations, &(0..rows).map(widths).collect::<Vec<_>>(), group)?;
        let bias = if bias { self.values(rows) } else { vec![0.0; rows] };
        self.node(Linear { matrix, bias }, &[input])
    }

    /// The policy, whose action is the last node's output.
    pub fn finish(self, name: String, contract: bool) -> (Policy, Vec<Outcome>) {
        let act_len = self.graph.len_of(self.graph.output());
        let array = |value: f32| contract.then(|| vec![value; act_len]);
        let policy = Policy {
            dir: PathBuf::new(),
            name,
            kind: Kind::Step,
            chunk: 1,
            execute: 1,
            act_len,
            rate_hz: 100.0,
            contract: ActionContract {
                scale: array(0.5),
                offset: array(0.1),
                low: array(-1.0),
                high: array(1.0),
                max_step: array(0.25),
            },
            weights: self.graph.weights(),
            graph: self.graph,
            digest: [0; 32],
        };
        (policy, self.outcomes)
    }

    /// A node of its own part of the observation.
    pub fn node_of_part(&mut self, len: usize, kind: impl Into<NodeKind>) -> Result<ValueId> {
        let input = self.part(len)?;
        self.node(kind, &[input])
    }
}
