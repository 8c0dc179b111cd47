//! Places the graph's values in the arena.
//!
//! The operations define what they become over buffers ([`crate::graph::lowering`]); this module assigns the buffers
//! their offsets. The arena holds in this order: the recurrent state, the observation, the values, the last action with
//! what is kept beside it, and the work area. Values share memory by their lifetimes, first fit. Buffers are placed in
//! the order in which they are written, each at the lowest offset that fits. No gaps remain, so whatever a step has
//! written is a prefix of the arena; the image's check requires this.

use actq_kernels::image::{OpKind, Region, kept_words};

use crate::around::{Around, OUTPUT};
use crate::error::{Result, ensure};
use crate::graph::ValueId;
use crate::graph::copies::Steps;
use crate::graph::lowering::{Buffer, BufferId, Lifetime, Lowering, Slice, Step, StepData};
use crate::graph::steps::{lower_nodes, readers};
use crate::policy::Policy;

/// The arena and the operations in it.
#[derive(Debug)]
pub struct Program {
    /// Operations in order.
    pub steps: Vec<Step<Region>>,
    /// Recurrent state; zeroed by a reset.
    pub state: Region,
    /// Observation. The caches of a prefix are between the state and it.
    pub observation: Region,
    /// First operation of the denoising steps. Earlier ones run once per evaluation; 0 if all run every time.
    pub first_denoising_op: usize,
    /// The network's output.
    pub output: Region,
    /// Action.
    pub action: Region,
    /// Prepared activations.
    pub work: Region,
    /// Words of the arena.
    pub words: usize,
}

/// Words that the prepared input of a matrix takes.
#[derive(Clone, Copy, Debug, Default)]
pub struct PreparedWords {
    /// In the work area.
    pub apart: usize,
    /// In the input's own words; `None` where it must not be prepared there.
    pub in_place: Option<usize>,
}

/// Lowers the policy's graph and what is `around` it, for matrices with these prepared inputs. (Sizes of the arena do not
/// count where there are none.)
pub fn lower(policy: &Policy, around: Option<&Around>, prepared: &[PreparedWords]) -> Result<Program> {
    let graph = &policy.graph;
    ensure!(
        around.is_none() || graph.prefix_len == 0,
        "a network that reads a prefix cannot have operations around it; quantize it from its own folder"
    );
    let mut readers = readers(graph);
    let mut lowering = match around {
        Some(around) => {
            let read =
                |step: &Step<Slice>| [step.src, step.third].iter().flatten().any(|s| s.buffer == around.observation);
            // The network must not overwrite what is read after it.
            readers[0] += usize::from(around.after.iter().any(read));
            Lowering::inside(around.before.clone(), around.buffers.clone(), around.observation, readers)
        }
        None => Lowering::new(graph.own_len(), readers),
    };
    let (contract, act_len) = (&policy.contract, policy.act_len);
    let horizon = contract.playback.ensemble.map_or(0, |ensemble| ensemble.horizon);
    let kept = kept_words([act_len, policy.chunk, policy.execute], horizon, contract.playback.overlap);
    let kept_len = kept + if contract.binarise.is_some() { act_len } else { 0 };
    let Some(denoising) = &graph.denoising else {
        lower_nodes(&graph.nodes, &mut lowering);
        if let Some(around) = around {
            let output = lowering.place(graph.output());
            lowering.steps.extend(around.after.iter().map(|step| after(step, output)));
            let action = lowering.whole(around.action);
            return Arena { lowering, kept_len, prepared }.assign(OBSERVATION, 0, action, act_len);
        }
        let output = lowering.private(graph.output());
        let output = lowering.whole(output);
        return Arena { lowering, kept_len, prepared }.assign(OBSERVATION, 0, output, act_len);
    };
    let iterate = lowering.noise(graph.noise_len(), denoising.len);
    let (before, of_step) = graph.nodes.split_at(denoising.first);
    lower_nodes(before, &mut lowering);
    let mut read: Vec<ValueId> =
        of_step.iter().flat_map(|node| node.kind.prepare(&mut lowering, &node.inputs, denoising.first)).collect();
    read.retain(|value| *value <= denoising.first);
    let first_denoising_op = lowering.begin_steps(iterate, &read);
    lower_nodes(of_step, &mut lowering);
    let mut constants = vec![denoising.limit, f32::from_bits(0)];
    constants.extend(denoising.steps.iter().flat_map(|step| step.to_array()));
    let (velocity, read_next) = (lowering.place(graph.output()), lowering.whole(lowering.iterate()));
    let data =
        StepData::Denoise { constants, noise: denoising.draws().then_some(Slice { offset: denoising.len, ..iterate }) };
    lowering.emit(OpKind::Denoise, iterate, Some(velocity), Some(read_next), data);
    Arena { lowering, kept_len, prepared }.assign(OBSERVATION, first_denoising_op, iterate, act_len)
}

/// Returns an operation after the network, whose output has its place now.
fn after(step: &Step<Slice>, output: Slice) -> Step<Slice> {
    let placed = |s: Slice| match s.buffer {
        OUTPUT => Slice { buffer: output.buffer, offset: output.offset + s.offset, ..s },
        _ => s,
    };
    Step { dst: placed(step.dst), src: step.src.map(placed), third: step.third.map(placed), ..step.clone() }
}

/// Returns an operation's data with the place of its noise, if it has any.
fn placed_data(data: &StepData, region: impl Fn(Slice) -> Region) -> StepData {
    match data {
        StepData::Denoise { constants, noise: Some(noise) } => {
            let mut constants = constants.clone();
            constants[1] = f32::from_bits(region(*noise).offset as u32);
            StepData::Constants(constants)
        }
        StepData::Denoise { constants, noise: None } => StepData::Constants(constants.clone()),
        data => data.clone(),
    }
}

const OBSERVATION: BufferId = 0;

/// Buffers without offsets.
struct Arena<'a> {
    lowering: Lowering,
    /// Words that contract and playback keep beside the last action.
    kept_len: usize,
    /// By matrix.
    prepared: &'a [PreparedWords],
}

/// Offsets of the buffers in the arena.
struct Placement {
    offsets: Vec<usize>,
    state_len: usize,
    /// Words of all buffers.
    end: usize,
}

impl Placement {
    fn region(&self, slice: Slice) -> Region {
        Region { offset: self.offsets[slice.buffer] + slice.offset, len: slice.len }
    }
}

impl Arena<'_> {
    /// Assigns every buffer its offset. What is in `output` is read after the last operation, and by later steps of a
    /// chunk.
    fn assign(
        mut self,
        observation: BufferId,
        first_denoising_op: usize,
        output: Slice,
        act_len: usize,
    ) -> Result<Program> {
        self.lowering.buffers[output.buffer].lifetime = Lifetime::Output;
        let buffers = &self.lowering.buffers;
        let outside = |slice: Slice| buffers[slice.buffer].lifetime == Lifetime::Outside;
        for step in &self.lowering.steps {
            ensure!(
                !step.operands().into_iter().flatten().any(outside),
                "keys and values of a prefix come from the host; only attention can read them"
            );
        }
        let (steps, placement) = self.placed(first_denoising_op);
        let state_len = placement.state_len;
        let action = Region { offset: placement.end, len: act_len };
        let work_offset = action.offset + action.len + self.kept_len;
        let apart = steps.steps.iter().filter(|step| matches!(step.kind, OpKind::Linear { in_place: false, .. }));
        let prepared = apart.map(|step| self.prepared(step).apart);
        let work_len = prepared.max().unwrap_or(0).max(self.lowering.work_words);
        let words = work_offset + work_len;
        ensure!(
            words <= usize::from(u16::MAX),
            "the policy needs {words} words of scratch memory, but at most 65535 are supported; use a smaller network"
        );
        let region = |slice: Slice| placement.region(slice);
        let first_denoising_op = steps.first_denoising_op;
        let placed = steps.steps.iter().map(|step| Step {
            kind: step.kind,
            dst: region(step.dst),
            src: step.src.map(region),
            third: step.third.map(region),
            data: placed_data(&step.data, region),
        });
        Ok(Program {
            steps: placed.collect(),
            state: Region { offset: 0, len: state_len },
            observation: region(Slice { buffer: observation, offset: 0, len: buffers[observation].len }),
            first_denoising_op,
            output: region(output),
            action,
            work: Region { offset: work_offset, len: work_len },
            words,
        })
    }

    /// Places the buffers, without copies as far as this takes no more memory and leaves no gaps.
    fn placed(&self, first_denoising_op: usize) -> (Steps<'_>, Placement) {
        let Lowering { steps, buffers, .. } = &self.lowering;
        let with_copies = || Steps { steps: steps.clone(), first_denoising_op, buffers };
        let placed = |mut steps| {
            let lives = lifetimes(&steps);
            self.prepare_in_place(&mut steps, &lives);
            let placement = self.place(&steps, &lives);
            (steps, placement)
        };
        let all = placed(with_copies());
        let most = all.1.end;
        let mut apart = vec![false; buffers.len()];
        for _ in 0..MAX_TRIES {
            let (steps, placement) = placed(with_copies().without_copies(&|buffer| apart[buffer]));
            match gap(&steps, &placement) {
                None if placement.end <= most => return (steps, placement),
                Some(Some(partial)) if !apart[partial] => apart[partial] = true,
                _ => break,
            }
        }
        let (steps, placement) = placed(with_copies().without_copies(&|_| true));
        if placement.end <= most && gap(&steps, &placement).is_none() { (steps, placement) } else { all }
    }

    /// Lets products prepare their input in its own place, if nothing reads it after them.
    fn prepare_in_place(&self, steps: &mut Steps<'_>, lives: &[Life]) {
        let buffers = steps.buffers;
        for (at, step) in steps.steps.iter_mut().enumerate() {
            let fits = self.prepared(step).in_place.is_some();
            if let (OpKind::Linear { in_place, .. }, Some(src)) = (&mut step.kind, step.src) {
                let is_last = lives.iter().any(|(buffer, (_, last))| *buffer == src.buffer && *last == at);
                *in_place = fits && is_last && src.len == buffers[src.buffer].len;
            }
        }
    }

    /// Places the buffers in as few words as it finds: with all outputs beginning in their inputs that may, or with none, and
    /// then with each of them the other way if that takes fewer.
    fn place(&self, steps: &Steps<'_>, lives: &[Life]) -> Placement {
        let left: Vec<_> = steps.steps.iter().map(|step| self.left_of_input(step)).collect();
        let [all, none] = [left.clone(), vec![None; left.len()]].map(|left| (place(steps.buffers, lives, &left), left));
        let (mut best, mut kept) = if none.0.end < all.0.end { none } else { all };
        for at in (0..left.len()).filter(|at| left[*at].is_some()) {
            let mut other = kept.clone();
            other[at] = if kept[at].is_some() { None } else { left[at] };
            let placement = place(steps.buffers, lives, &other);
            if placement.end < best.end {
                (best, kept) = (placement, other);
            }
        }
        best
    }

    /// Returns the words of its input that a product still needs when it writes the first output; `None` if it needs all.
    fn left_of_input(&self, step: &Step<Slice>) -> Option<usize> {
        let StepData::Product { bias, .. } = &step.data else { return None };
        let writes_once = step.kind == OpKind::Linear { accumulate: false, in_place: true };
        if writes_once && bias.iter().any(|bias| *bias != 0.0) { self.prepared(step).in_place } else { None }
    }

    fn prepared(&self, step: &Step<Slice>) -> PreparedWords {
        match step.data {
            StepData::Product { matrix, .. } => self.prepared.get(matrix).copied().unwrap_or_default(),
            _ => PreparedWords::default(),
        }
    }
}

/// Arrangements with parts computed in place that are tried before one with all parts apart.
const MAX_TRIES: usize = 16;

/// Finds an operation that writes after a gap, or a gap at the end: the image's check refuses both. Returns the buffer
/// in which it is, if there is one.
fn gap(steps: &Steps<'_>, placement: &Placement) -> Option<Option<BufferId>> {
    let fixed = |lifetime| matches!(lifetime, Lifetime::Observation | Lifetime::State | Lifetime::Prefix);
    let before = steps.buffers.iter().zip(&placement.offsets).filter(|(buffer, _)| fixed(buffer.lifetime));
    let mut written = before.map(|(buffer, offset)| offset + buffer.len).max().unwrap_or(0);
    let mut begun = Vec::new();
    let end = Region { offset: placement.end, len: 0 };
    // Of each operation, and of the end.
    for dst in steps.steps.iter().map(|step| Some(step.dst)).chain([None]) {
        let region = dst.map_or(end, |dst| placement.region(dst));
        begun.extend(dst.map(|dst| dst.buffer));
        if region.offset > written {
            let is_partial = |buffer: &&BufferId| {
                let offset = placement.offsets[**buffer];
                (offset..offset + steps.buffers[**buffer].len).contains(&written)
            };
            return Some(begun.iter().rev().find(is_partial).copied());
        }
        written = written.max(region.offset + region.len);
    }
    None
}

/// Places the buffers: first the state, then the prefix and the observation, then the values by their lifetimes. An output may
/// begin where its operation has this much `left` of its input.
fn place(buffers: &[Buffer], lives: &[Life], left: &[Option<usize>]) -> Placement {
    let mut offsets = vec![0; buffers.len()];
    let mut top = 0;
    let mut state_len = 0;
    for lifetime in [Lifetime::State, Lifetime::Prefix, Lifetime::Observation] {
        for (offset, buffer) in offsets.iter_mut().zip(buffers).filter(|(_, b)| b.lifetime == lifetime) {
            *offset = top;
            top += buffer.len;
        }
        if lifetime == Lifetime::State {
            state_len = top;
        }
    }
    let mut ends = vec![top];
    let mut placed: Vec<(usize, (usize, usize))> = Vec::new();
    for &(buffer, life) in lives {
        let len = buffers[buffer].len;
        // Of what a placed buffer still needs when this one begins.
        let end = |other: BufferId, (_, last): (usize, usize)| {
            let len = if last == life.0 { left.get(last).copied().flatten() } else { None };
            offsets[other] + len.unwrap_or(buffers[other].len)
        };
        let taken = |offset: usize| {
            let clash = |&&(other, span): &&(usize, (usize, usize))| {
                let meets = span.0 <= life.1 && life.0 <= span.1;
                meets && offset < end(other, span) && offsets[other] < offset + len
            };
            placed.iter().find(clash).map(|&(other, span)| end(other, span))
        };
        let mut offset = top;
        while let Some(next) = taken(offset) {
            offset = next;
        }
        offsets[buffer] = offset;
        ends.push(offset + len);
        placed.push((buffer, life));
    }
    Placement { offsets, state_len, end: ends.into_iter().max().unwrap_or(top) }
}

/// A buffer, with the first and the last operation that needs it.
type Life = (BufferId, (usize, usize));

/// Returns the first and last operation that needs each value's buffer, in order of the first.
fn lifetimes(steps: &Steps<'_>) -> Vec<Life> {
    let mut lives: Vec<Life> = Vec::new();
    for (at, step) in steps.steps.iter().enumerate() {
        for slice in step.operands().into_iter().flatten() {
            let last = match steps.buffers[slice.buffer].lifetime {
                Lifetime::Step => at,
                Lifetime::Output => usize::MAX,
                Lifetime::Observation | Lifetime::State | Lifetime::Prefix | Lifetime::Outside => continue,
            };
            match lives.iter_mut().find(|(buffer, _)| *buffer == slice.buffer) {
                Some((_, life)) => life.1 = last,
                None => lives.push((slice.buffer, (at, last))),
            }
        }
    }
    lives
}
