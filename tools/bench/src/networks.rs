//! Networks of random weights, for measurements and property tests.

use std::path::Path;

use actq::contract::ActionContract;
use actq::emit;
use actq::graph::ops::{Add, Concat, Gru, LayerNorm, Linear, Lstm, Mul, Normalize, Pointwise, RmsNorm, Span};
use actq::graph::{Graph, NodeKind, ValueId, WeightMatrix};
use actq::methods::scale::round_to_nearest;
use actq::methods::{Activations, Outcome, Quantized};
use actq::policy::Policy;
use actq::random::Random;
use actq::runtime::{ImageBuffer, with_head};
use actq_kernels::Width;
use actq_kernels::image::{Kind, header as h, op, seal};
use actq_kernels::math::Function;
use anyhow::{Context, Result, ensure};

/// A network under construction: each operation gets its own part of the observation.
#[derive(Debug)]
pub struct Builder {
    /// Length of the observation so far.
    pub graph: Graph,
    outcomes: Vec<Outcome>,
    random: Random,
}

impl Builder {
    /// Creates a network without operations.
    pub fn new(observation: usize) -> Self {
        Self { graph: Graph::new(observation), outcomes: Vec::new(), random: Random::new(2) }
    }

    /// Adds an operation on values; returns its output.
    pub fn node(&mut self, kind: impl Into<NodeKind>, inputs: &[ValueId]) -> Result<ValueId> {
        Ok(self.graph.add(kind, inputs)?)
    }

    /// Returns the first values of the observation.
    pub fn part(&mut self, len: usize) -> Result<ValueId> {
        self.node(Concat(vec![Span { from: 0, len }]), &[0])
    }

    /// Draws values between -1 and 1.
    pub fn values(&mut self, len: usize) -> Vec<f32> {
        (0..len).map(|_| self.random.unit()).collect()
    }

    /// Adds a matrix that keeps the variance of its input, with a width for each row; rows without one have no bits.
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
                replace_row(&mut quantized, row, &other);
            }
        }
        self.outcomes.push(Outcome::new(&matrix, quantized, None, activations)?);
        Ok(self.graph.add_matrix(matrix)?)
    }

    /// Adds a product with a part of the observation, with random biases or none.
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

    /// Returns the policy, whose action is the last node's output.
    pub fn finish(self, name: String, contract: bool) -> (Policy, Vec<Outcome>) {
        let act_len = self.graph.len_of(self.graph.output());
        let array = |value: f32| contract.then(|| vec![value; act_len]);
        let policy = Policy {
            rate_hz: 100.0,
            contract: ActionContract {
                scale: array(0.5),
                offset: array(0.1),
                low: array(-1.0),
                high: array(1.0),
                max_step: array(0.25),
                ..ActionContract::default()
            },
            ..Policy::of(&name, self.graph)
        };
        (policy, self.outcomes)
    }

    /// Returns the image of the policy without a contract.
    pub fn image(self, name: &str) -> Result<Vec<u8>> {
        let (policy, outcomes) = self.finish(name.to_owned(), false);
        Ok(emit::image(&policy, &outcomes)?)
    }

    /// Returns an image of which every linear operation that has biases, and whose output already holds values, accumulates:
    /// the format has such operations, and no graph lowers to one. It makes chunks of single values: then outputs do not
    /// share the work area, and those of one length follow each other in the same words.
    pub fn accumulating(self, name: &str) -> Result<Vec<u8>> {
        let (mut policy, outcomes) = self.finish(name.to_owned(), false);
        (policy.kind, policy.chunk, policy.act_len) = (Kind::Chunk, policy.act_len, 1);
        let mut bytes = emit::image(&policy, &outcomes)?;
        let name = Path::new(name);
        let count = ImageBuffer::new(&bytes).image(name)?.op_count();
        let first = word(&bytes, h::W_OPS) as usize;
        let mut changed = 0;
        for record in (first..).step_by(h::OP_WORDS).take(count) {
            if word(&bytes, record) as u8 == op::LINEAR && word(&bytes, record + 2) != 0 {
                let mut with = bytes.clone();
                with[4 * record + 1] = 1;
                seal(&mut with).context("cannot seal the image: it is too long")?;
                // Refused if nothing was written there.
                if ImageBuffer::new(&with).image(name).is_ok() {
                    (bytes, changed) = (with, changed + 1);
                }
            }
        }
        ensure!(changed > 0, "the image has no operation that can accumulate");
        // The actions differ from those of the self-test vector.
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(name)?;
        let mut at = 4 * word(&bytes, h::W_SELF_TEST) as usize;
        with_head::<_, anyhow::Error>(image, |head| {
            for step in 0..image.self_test_steps() {
                let (observation, _) = image.self_test(step).context("the self-test has such a step")?;
                let observation: Vec<f32> =
                    observation.iter().map(|word| f32::from_bits(u32::from_le(*word))).collect();
                let action: Vec<u8> = head.step(&observation)?.iter().flat_map(|value| value.to_le_bytes()).collect();
                at += 4 * observation.len();
                bytes[at..][..action.len()].copy_from_slice(&action);
                at += action.len();
            }
            Ok(())
        })?;
        seal(&mut bytes).context("cannot seal the image: it is too long")?;
        Ok(bytes)
    }

    /// Adds a node with its own part of the observation.
    pub fn node_of_part(&mut self, len: usize, kind: impl Into<NodeKind>) -> Result<ValueId> {
        let input = self.part(len)?;
        self.node(kind, &[input])
    }
}

/// Draws networks, and what the shape of a matrix leaves open.
#[derive(Debug)]
pub struct Draw(Random);

impl Draw {
    /// Creates the generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(Random::new(seed))
    }

    /// Draws a number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// Activations in paired lanes (for groups of 0 and 32) or in single lanes.
    fn activations(&mut self) -> Activations {
        [Activations::Int8, Activations::Int16][self.below(2)]
    }

    /// Draws the group size of a matrix.
    pub fn group(&mut self) -> usize {
        [0, 32, 64, 128][self.below(4)]
    }

    /// A width for each row: all equal, in blocks, or mixed with rows of 0 bits.
    fn widths(&mut self, rows: usize) -> Vec<Option<Width>> {
        let (kind, one) = (self.below(3), Width::ALL[self.below(4)]);
        let width = |row: usize| match kind {
            0 => Some(one),
            1 => Some(Width::ALL[4 * row / rows]),
            _ if row == 0 => Some(one),
            _ => Width::ALL.get(row * 7 % 5).copied(),
        };
        (0..rows).map(width).collect()
    }

    /// Adds a matrix.
    pub fn matrix(&mut self, builder: &mut Builder, rows: usize, cols: usize, group: usize) -> Result<usize> {
        let (activations, widths) = (self.activations(), self.widths(rows));
        builder.matrix(rows, cols, activations, &widths, group)
    }

    /// Adds a product with a value, with random biases or none.
    pub fn linear(&mut self, builder: &mut Builder, rows: usize, input: ValueId, group: usize) -> Result<ValueId> {
        let matrix = self.matrix(builder, rows, builder.graph.len_of(input), group)?;
        let bias = if self.below(2) == 0 { builder.values(rows) } else { vec![0.0; rows] };
        builder.node(Linear { matrix, bias }, &[input])
    }

    /// Returns a policy with every operation of a network, and chunks, that reads up to `observation` values.
    pub fn network(&mut self, observation: usize) -> Result<(Policy, Vec<Outcome>)> {
        let mut length = |most: usize| 1 + self.below(most);
        let (rows, hidden, out, chunk) = (length(90), length(40), length(5), length(4));
        let execute = length(chunk);
        let group = self.group();
        let mut builder = Builder::new(observation);
        let read = 1 + self.below(observation);
        let mut last = builder.part(read)?;
        last = self.linear(&mut builder, rows, last, group)?;
        let [mean, scale] = [builder.values(rows), builder.values(rows)];
        last = builder.node(Normalize { mean, scale, pre_clip: 4.0, clip: 2.0 }, &[last])?;
        let kept = last;
        last = builder.node(Pointwise(Function::ALL[self.below(Function::ALL.len())]), &[last])?;
        last = builder.node(Add, &[last, kept])?;
        last = builder.node(Mul, &[last, kept])?;
        let [weight, bias] = [builder.values(rows), builder.values(rows)];
        last = builder.node(LayerNorm { weight: weight.clone(), bias, eps: 1e-3 }, &[last])?;
        last = builder.node(RmsNorm { weight, eps: 1e-3 }, &[last])?;
        match self.below(3) {
            0 => {
                let input = self.matrix(&mut builder, 4 * hidden, rows, group)?;
                let state = self.matrix(&mut builder, 4 * hidden, hidden, group)?;
                let bias = builder.values(4 * hidden);
                last = builder.node(Lstm { hidden, input, state, bias }, &[last])?;
            }
            1 => {
                let input = self.matrix(&mut builder, 3 * hidden, rows, group)?;
                let state = self.matrix(&mut builder, 3 * hidden, hidden, group)?;
                let (input_bias, state_bias) = (builder.values(3 * hidden), builder.values(3 * hidden));
                last = builder.node(Gru { hidden, input, state, input_bias, state_bias }, &[last])?;
            }
            _ => {}
        }
        self.linear(&mut builder, chunk * out, last, group)?;
        let (mut policy, outcomes) = builder.finish("network".to_owned(), false);
        (policy.act_len, policy.chunk, policy.execute) = (out, chunk, execute);
        policy.kind = if chunk > 1 { Kind::Chunk } else { Kind::Step };
        Ok((policy, outcomes))
    }
}

/// Copies a row from `other`, a matrix of the same size and groups.
pub fn replace_row(matrix: &mut Quantized, row: usize, other: &Quantized) {
    let (cols, groups) = (matrix.cols, matrix.groups());
    matrix.widths[row] = other.widths[row];
    matrix.scales[row] = other.scales[row];
    matrix.codes[row * cols..][..cols].copy_from_slice(&other.codes[row * cols..][..cols]);
    matrix.group_scales[row * groups..][..groups].copy_from_slice(&other.group_scales[row * groups..][..groups]);
}

/// Returns the image with another expected action in its self-test.
pub fn with_wrong_self_test(image: &[u8]) -> Result<Vec<u8>> {
    let obs_len = ImageBuffer::new(image).image(Path::new("the image"))?.obs_len();
    let mut wrong = image.to_vec();
    wrong[4 * (word(image, h::W_SELF_TEST) as usize + obs_len)] ^= 1;
    seal(&mut wrong).context("cannot seal the image: it is too long")?;
    Ok(wrong)
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([0, 1, 2, 3].map(|i| bytes[4 * at + i]))
}
