//! Writes an image's words.

use std::iter;
use std::path::Path;

use actq_kernels::activations::{Plan, max_prepared_words};
use actq_kernels::cost::Core;
use actq_kernels::image::{
    BlockRecord, Header, Kind, MatrixRecord, OpKind, OpRecord, Port, PortKind, Records, Region, half_words,
    header as h, quarter_words, seal,
};
use actq_kernels::layout::{self, BlockShape};

use super::lower::{PreparedWords, lower};
use super::raw_values::raw_values;
use crate::around::{Around, NamedPort};
use crate::contract::ActionContract;
use crate::error::{Context, Result, ensure};
use crate::graph::lowering::{Step, StepData};
use crate::graph::{Graph, NodeKind};
use crate::methods::{Outcome, Quantized};
use crate::policy::Policy;
use crate::random::Random;
use crate::runtime::{ImageBuffer, with_head};

/// Most bytes of a self-test of more than one step.
const SELF_TEST_BYTES: usize = 64 << 10;

/// Writes the image of a policy's network with its quantized matrices, one per matrix of the graph. The executor itself
/// computes the self-test's actions.
///
/// # Errors
///
/// If a size of the policy exceeds the format, if the kernels refuse the image, or if the network leaves f32's range on
/// the self-test's observations.
pub fn image(policy: &Policy, matrices: &[Outcome]) -> Result<Vec<u8>> {
    emit(policy, matrices, None)
}

/// Writes the image of a network with everything around it: its observation is the raw values, its action what `around`
/// makes of the network's. The policy's own contract does not apply.
///
/// # Errors
///
/// As [`image`].
pub fn image_around(policy: &Policy, matrices: &[Outcome], around: &Around) -> Result<Vec<u8>> {
    emit(&policy_around(policy, around)?, matrices, Some(around))
}

/// Returns the policy with the action and the limits of the operations around its network.
fn policy_around(policy: &Policy, around: &Around) -> Result<Policy> {
    ensure!(policy.kind == Kind::Step, "only a policy of kind step can have operations around its network");
    let [low, high] = around.limits.clone().map_or([None, None], |limits| limits.map(Some));
    let contract = ActionContract { low, high, ..ActionContract::default() };
    Ok(Policy { act_len: around.action_len(), contract, ..policy.clone() })
}

fn emit(policy: &Policy, matrices: &[Outcome], around: Option<&Around>) -> Result<Vec<u8>> {
    let mut writer = Writer::new();
    let records = matrices.iter().map(|m| writer.matrix(m)).collect::<Result<Vec<_>>>()?;
    let Draft { mut words, self_test, observations } = writer.finish(policy, &records, around)?;
    let unfit = "no image can hold the result; recorded observations near the limits of f32 are a common cause";
    let actions = self_test_actions(&sealed(&words)?, &observations, unfit)?;
    let obs_len = obs_len(policy, around);
    for (step, action) in actions.iter().enumerate() {
        let at = self_test + step * (obs_len + policy.act_len) + obs_len;
        for (word, value) in words[at..].iter_mut().zip(action) {
            *word = value.to_bits();
        }
    }
    sealed(&words)
}

/// Returns the bytes of an image of `policy` without its matrices' blocks, and with what is around its network. Values
/// of its matrices do not count.
pub fn bytes_beside_blocks(policy: &Policy) -> Result<usize> {
    let records = vec![[0; h::MATRIX_WORDS]; policy.graph.matrices.len()];
    let draft = match &policy.around {
        Some(around) => Writer::new().finish(&policy_around(policy, around)?, &records, Some(around))?,
        None => Writer::new().finish(policy, &records, None)?,
    };
    Ok(4 * draft.words.len())
}

fn obs_len(policy: &Policy, around: Option<&Around>) -> usize {
    around.map_or(policy.graph.own_len(), Around::raw_len)
}

/// An image without the actions of its self-test, its length and its checksum.
struct Draft {
    words: Vec<u32>,
    /// Offset of the self-test, in words.
    self_test: usize,
    observations: Vec<Vec<f32>>,
}

/// Returns the image's bytes with length and checksum.
pub(super) fn sealed(words: &[u32]) -> Result<Vec<u8>> {
    let mut bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    seal(&mut bytes).context("the image is larger than 4 GB")?;
    Ok(bytes)
}

/// Returns the steps of a self-test. One step tests everything if none depends on an earlier one. Else a chunk and the
/// beginning of the next do, or as much of them as fits with long observations.
fn self_test_steps(policy: &Policy, state_len: usize, obs_len: usize) -> usize {
    if policy.kind == Kind::Step && state_len == 0 && !policy.contract.has_memory() {
        return 1;
    }
    let horizon = policy.contract.playback.ensemble.map_or(0, |ensemble| ensemble.horizon);
    let fitting = SELF_TEST_BYTES / (4 * (obs_len + policy.act_len));
    (policy.execute.max(horizon) + 2).min(fitting.max(1))
}

/// Makes observations that reach every input: spread over about two standard deviations if the policy normalizes, else
/// over -1 to 1, from a fixed generator.
fn self_test_observations(graph: &Graph, steps: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(0);
    let norm = graph.nodes.iter().find_map(|node| match &node.kind {
        NodeKind::Normalize(norm) if node.inputs == [0] => Some(norm),
        NodeKind::Balance(balance) if node.inputs == [0] => Some(balance.normalize()),
        _ => None,
    });
    let mut value = |i: usize| match norm {
        Some(norm) if norm.scale[i].abs() > 1e-6 => norm.mean[i] + 2.0 * random.unit() / norm.scale[i],
        _ => random.unit(),
    };
    (0..steps).map(|_| (0..graph.own_len()).map(&mut value).collect()).collect()
}

/// Returns the actions of a new image from its start; if it is not valid, the error begins with `unfit`.
pub(super) fn self_test_actions(bytes: &[u8], observations: &[Vec<f32>], unfit: &'static str) -> Result<Vec<Vec<f32>>> {
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(Path::new("the new image")).context(unfit)?;
    with_head(image, |head| {
        head.set_test_prefix();
        observations.iter().map(|obs| Ok(head.step(obs).context("self-test of the new image")?.to_vec())).collect()
    })
}

struct Writer {
    words: Vec<u32>,
    /// Offset of the matrix records.
    matrices: u32,
    /// By matrix.
    prepared: Vec<PreparedWords>,
    /// Offset from which on all words are finite constants of operations, which other operations may share.
    shared_constants: usize,
}

impl Writer {
    /// Makes an image with room for its header.
    fn new() -> Self {
        Self { words: vec![0; h::WORDS], matrices: 0, prepared: Vec::new(), shared_constants: 0 }
    }

    /// Appends everything after the matrices' blocks; `matrices` are their records.
    fn finish(
        mut self,
        policy: &Policy,
        matrices: &[[u32; h::MATRIX_WORDS]],
        around: Option<&Around>,
    ) -> Result<Draft> {
        let program = lower(policy, around, &self.prepared)?;
        let obs_len = obs_len(policy, around);
        self.matrices = self.push(matrices.iter().flatten().copied());
        self.shared_constants = self.words.len();
        let records = program.steps.iter().map(|step| self.op(step)).collect::<Result<Vec<[u32; h::OP_WORDS]>>>()?;
        let ops = self.push(records.into_iter().flatten());
        let (contract, contract_flags) = self.contract(&policy.contract);
        let playback = policy.contract.playback;
        let horizon = playback.ensemble.map_or(0, |ensemble| ensemble.horizon);
        let name = self.push_bytes(policy.name.as_bytes());
        let steps = self_test_steps(policy, program.state.len, obs_len);
        let observations = match around {
            Some(around) => raw_values(around, &mut Random::new(0), steps, false),
            None => self_test_observations(&policy.graph, steps),
        };
        let self_test = self.words.len() as u32;
        for observation in &observations {
            self.push_floats(observation);
            self.push_floats(&vec![0.0; policy.act_len]);
        }
        let ports = around.map(|around| &around.ports[..]).unwrap_or_default();
        self.ports(ports)?;
        let header = Header {
            kind: policy.kind,
            has_ports: !ports.is_empty(),
            obs_len,
            act_len: policy.act_len,
            chunk: policy.chunk,
            execute: policy.execute,
            horizon,
            overlap: playback.overlap,
            deadline: playback.deadline.unwrap_or(0),
            rate_hz: policy.rate_hz,
            scratch: program.words,
            state: program.state,
            observation: program.observation.offset,
            output: program.output.offset,
            action: program.action.offset,
            work: program.work,
            matrices: Records { offset: self.matrices, count: matrices.len() },
            ops: Records { offset: ops, count: program.steps.len() },
            first_denoising_op: program.first_denoising_op,
            denoising_steps: policy.graph.denoising.as_ref().map_or(0, |denoising| denoising.steps.len()),
            contract,
            contract_flags,
            name: Records { offset: name, count: policy.name.len() },
            self_test: Records { offset: self_test, count: steps },
            weights: policy.weights as u32,
            digest: policy.digest,
        };
        self.words[..h::WORDS].copy_from_slice(&header.emit()?);
        Ok(Draft { words: self.words, self_test: self_test as usize, observations })
    }

    /// Appends the arrays of the contract and the weights of its ensemble. Returns their offset, with a flag for each
    /// array that is present.
    fn contract(&mut self, contract: &ActionContract) -> (u32, usize) {
        let offset = self.words.len() as u32;
        let mut flags = 0;
        for (bit, (_, array)) in contract.arrays().into_iter().enumerate() {
            if let Some(array) = array {
                flags |= 1 << bit;
                self.push_floats(array);
            }
        }
        if let Some(ensemble) = contract.playback.ensemble {
            self.push_floats(&ensemble.weights());
        }
        (offset, flags)
    }

    /// Appends raw inputs and targets.
    fn ports(&mut self, ports: &[NamedPort]) -> Result<()> {
        if ports.is_empty() {
            return Ok(());
        }
        let inputs = ports.iter().filter(|port| port.kind == PortKind::Input).count();
        let mut records = vec![(inputs | (ports.len() - inputs) << 16) as u32];
        let mut texts: Vec<u8> = Vec::new();
        let (mut list, mut list_at) = (&[][..], 0);
        for NamedPort { kind, name, names, len, range } in ports {
            let end = |texts: &[u8]| (self.words.len() + 1 + Port::WORDS * ports.len() + texts.len() / 4) as u32;
            let name_at = end(&texts);
            texts.extend(whole_words(name));
            // Ports that follow each other often have the same joints: they share a list.
            if !names.is_empty() && names != list {
                let lines = names.join("\n");
                (list, list_at) = (names, end(&texts));
                texts.extend((lines.len() as u32).to_le_bytes());
                texts.extend(whole_words(&lines));
            }
            let names_at = if names.is_empty() { 0 } else { list_at };
            let port = Port { kind: *kind, name, names: "", len: *len, range: *range };
            records.extend(port.emit(name_at, names_at)?);
        }
        self.push(records);
        self.push_bytes(&texts);
        Ok(())
    }

    /// Appends words and returns their offset.
    fn push(&mut self, words: impl IntoIterator<Item = u32>) -> u32 {
        let offset = self.words.len() as u32;
        self.words.extend(words);
        offset
    }

    fn push_floats(&mut self, values: &[f32]) -> u32 {
        self.push(values.iter().map(|v| v.to_bits()))
    }

    fn constants(&mut self, values: &[f32]) -> u32 {
        place_constants(&mut self.words, &mut self.shared_constants, values)
    }

    fn push_bytes(&mut self, bytes: &[u8]) -> u32 {
        self.push(bytes.chunks(4).map(|c| c.iter().rev().fold(0, |word, b| word << 8 | u32::from(*b))))
    }

    /// Packs a matrix's blocks and returns its record.
    fn matrix(&mut self, outcome: &Outcome) -> Result<[u32; h::MATRIX_WORDS]> {
        let matrix = &outcome.quantized;
        ensure!(
            matrix.rows <= h::MAX_ROWS,
            "a matrix has {} rows, but at most {} are supported",
            matrix.rows,
            h::MAX_ROWS
        );
        let blocks = outcome.blocks();
        let in_order = Quantized::in_order(&blocks);
        self.prepared.push(prepared_words(outcome, &blocks));
        let mut records = Vec::new();
        for (shape, rows) in &blocks {
            let codes: Vec<u8> =
                rows.iter().flat_map(|r| &matrix.codes[r * matrix.cols..][..matrix.cols]).copied().collect();
            let groups = matrix.groups();
            let group_scales: Vec<u8> =
                rows.iter().flat_map(|r| &matrix.group_scales[r * groups..][..groups]).copied().collect();
            let mut words = vec![0; shape.words()];
            layout::pack(*shape, &codes, &group_scales, &mut words).with_context(|| {
                format!("cannot pack {shape:?}; docs/FORMAT.md lists how many columns may have group scales")
            })?;
            let weights = self.push(words.into_iter().map(u32::from_le));
            let scales: Vec<u16> = rows.iter().map(|&r| matrix.scales[r].to_bits()).collect();
            let scales = self.push(half_words(&scales));
            let steps = if in_order { 0 } else { self.push(quarter_words(&steps(rows)?)) };
            let BlockShape { width, lanes, rows, .. } = *shape;
            records.push(BlockRecord { width, lanes, rows, weights, scales, steps }.emit()?);
        }
        let Quantized { rows, cols, group, .. } = *matrix;
        let blocks = Records { count: records.len(), offset: self.push(records.into_iter().flatten()) };
        Ok(MatrixRecord { rows, cols, group, x_max: outcome.x_max, blocks }.emit()?)
    }

    fn op(&mut self, step: &Step<Region>) -> Result<[u32; h::OP_WORDS]> {
        let (bias, data) = match &step.data {
            StepData::None => (0, 0),
            // Its first words are not only f32 constants, so later operations must not share any words up to here.
            StepData::Constants(values) if step.kind == OpKind::Denoise => {
                let data = self.push_floats(values);
                self.shared_constants = self.words.len();
                (0, data)
            }
            StepData::Words(words) => {
                let data = self.push(words.iter().copied());
                self.shared_constants = self.words.len();
                (0, data)
            }
            StepData::Constants(values) | StepData::Denoise { constants: values, .. } => (0, self.constants(values)),
            StepData::Product { matrix, bias } => {
                let bias = if bias.iter().all(|b| *b == 0.0) { 0 } else { self.constants(bias) };
                (bias, self.matrices + (matrix * h::MATRIX_WORDS) as u32)
            }
        };
        let offset = |region: Option<Region>| region.map_or(0, |r| r.offset);
        let (src, third) = (offset(step.src), offset(step.third));
        Ok(OpRecord { kind: step.kind, dst: step.dst, src, third, bias, data }.emit()?)
    }
}

/// Returns the words that the prepared input of a matrix with these blocks takes. It may be prepared in place for one block with
/// all rows, in the layouts of every core ([`super::repack`]).
fn prepared_words(outcome: &Outcome, blocks: &[(BlockShape, Vec<usize>)]) -> PreparedWords {
    let Quantized { rows, cols, group, .. } = outcome.quantized;
    let apart = max_prepared_words(cols, group, outcome.lanes());
    let on_every_core = |shape: BlockShape| {
        Core::ALL.into_iter().try_fold(apart, |words, (_, core)| {
            let plan = Plan::new(BlockShape { lanes: core.lanes(outcome.x_max, group), ..shape })?;
            plan.fits_in_place().then(|| words.max(plan.words()))
        })
    };
    let in_place = match blocks {
        [(shape, _)] if shape.rows == rows => on_every_core(*shape).filter(|words| *words <= cols),
        _ => None,
    };
    PreparedWords { apart, in_place }
}

/// Returns the offset of an operation's constants: of equal ones from `shared` on if present, else appends them to `to`.
pub(super) fn place_constants(to: &mut Vec<u32>, shared: &mut usize, values: &[f32]) -> u32 {
    let words: Vec<u32> = values.iter().map(|v| v.to_bits()).collect();
    let same = |window: &[u32]| window == words;
    if let Some(at) = to[*shared..].windows(words.len().max(1)).position(same) {
        return (*shared + at) as u32;
    }
    let offset = to.len() as u32;
    to.extend(words);
    if values.iter().any(|v| !v.is_finite()) {
        *shared = to.len();
    }
    offset
}

/// Returns the distances from each row's output to the next row's, and from output 0 to the first.
fn steps(rows: &[usize]) -> Result<Vec<u8>> {
    let before = iter::once(&0).chain(rows);
    let steps = before.zip(rows).map(|(before, row)| u8::try_from(row - before));
    steps.collect::<Result<_, _>>().context("rows of one width are more than 255 apart")
}

/// Returns a text's bytes, with zeros up to a whole word.
fn whole_words(text: &str) -> impl Iterator<Item = u8> + use<'_> {
    text.bytes().chain(iter::repeat_n(0, text.len().next_multiple_of(4) - text.len()))
}

#[cfg(test)]
mod tests {
    use actq_kernels::Width;

    use super::*;
    use crate::budget::Budget;
    use crate::contract::{Ensemble, Playback};
    use crate::data::Recordings;
    use crate::methods::{Method, Options};
    use crate::pipeline::quantize;
    use crate::testing;

    /// Returns the steps of the self-test of a policy's image.
    fn steps_of(policy: &Policy) -> usize {
        let calib = Some(testing::dataset(&policy.graph, 2, 20));
        let options = Options::new(Method::Rtn, Budget::Width(Width::W3));
        let made = quantize(policy, &Recordings { calib, heldout: None }, &options, ()).expect("an image");
        ImageBuffer::new(&made.image).image(Path::new("the new image")).expect("it is valid").self_test_steps()
    }

    #[test]
    fn stateful_policies_get_longer_self_tests() {
        let feed_forward = Policy::of("mlp", testing::mlp());
        assert_eq!(steps_of(&feed_forward), 1);
        assert_eq!(steps_of(&Policy::of("lstm", testing::lstm())), 3);

        let with = |contract| Policy { contract, ..feed_forward.clone() };
        let ones = Some(vec![1.0; feed_forward.act_len]);
        assert_eq!(steps_of(&with(ActionContract { max_step: ones.clone(), ..ActionContract::default() })), 3);
        assert_eq!(steps_of(&with(ActionContract { smoothing: ones.clone(), ..ActionContract::default() })), 3);
        assert_eq!(steps_of(&with(ActionContract { scale: ones, ..ActionContract::default() })), 1);
        let ensemble = Some(Ensemble { horizon: 1, m: 0.1 });
        let playback = Playback { ensemble, ..Playback::default() };
        assert_eq!(steps_of(&with(ActionContract { playback, ..ActionContract::default() })), 3);
    }
}
