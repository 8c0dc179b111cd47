//! The operations around the joined network, value by value.

use actq::around::{Around, NamedPort, OUTPUT};
use actq::error::{Context as _, Result, ensure};
use actq::graph::lowering::{Lifetime, Slice, StepData};
use actq_kernels::PortKind;
use actq_kernels::image::OpKind;

use super::chain::Chain;
use super::clock;
use super::joined::{Joined, Output, Source, has_weights, part};
use super::operations::{Operations, Phase, words};
use crate::description::{Clock, End, TargetKind, When};
use crate::plan::{Feed, Plan, PlannedOp, PlannedTarget, ValueIndex, ValueSource};
use crate::sources::Array;

/// Makes the operations.
pub(super) fn around(plan: &Plan, joined: &Joined) -> Result<Around> {
    let mut compiler = Compiler {
        plan,
        joined,
        to: Operations::default(),
        placed: vec![None; plan.values.len()],
        states: Vec::new(),
        before: Vec::new(),
        outputs: Vec::new(),
    };
    compiler.compile()
}

struct Compiler<'a> {
    plan: &'a Plan,
    joined: &'a Joined,
    to: Operations,
    placed: Vec<Option<Slice>>,
    /// Place of each state.
    states: Vec<Slice>,
    /// Places of outputs of the tick before.
    before: Vec<(Output, Slice)>,
    /// Places of outputs of this tick, after their contract.
    outputs: Vec<(Output, Slice)>,
}

impl Compiler<'_> {
    fn compile(&mut self) -> Result<Around> {
        let plan = self.plan;
        let raw: usize = plan.inputs.iter().map(|(_, len)| len).sum();
        ensure!(raw <= usize::from(u16::MAX), "there are {raw} raw values; an image takes at most 65535");
        self.to.buffer(raw, Lifetime::Observation);
        for state in &plan.states {
            let place = self.to.state(state.start.len());
            self.states.push(place);
            if state.start.iter().any(|number| *number != 0.0) {
                let count = self.to.state(1);
                let start = state.start.iter().map(|number| *number as f32).collect();
                self.to.emit(OpKind::Initial, place, None, Some(count), StepData::Constants(start));
            }
        }
        for (n, network) in plan.networks.iter().enumerate() {
            for feed in &network.feeds {
                if let Feed::Before(output, len) = feed
                    && self.before.iter().all(|(known, _)| *known != (n, *output))
                {
                    let place = self.to.state(*len);
                    self.before.push(((n, *output), place));
                }
            }
        }
        let mut sources = Vec::new();
        for source in &self.joined.observation {
            sources.push(match source {
                Source::Value(index) => self.place(*index)?,
                Source::Before(output) => find(&self.before, *output).context("a state has no place")?,
            });
        }
        let observation = self.to.concatenated(&sources);
        let is_whole = self.to.buffers[observation.buffer].len == observation.len;
        let observation = if is_whole && self.to.buffers[observation.buffer].lifetime == Lifetime::Step {
            observation
        } else {
            self.to.writable_copy(observation)
        };
        let targets = self.places(&plan.targets.iter().map(|target| target.value).collect::<Vec<_>>())?;
        self.to.phase = Phase::After;
        let action = self.to.value(targets.iter().map(|target| target.len).sum());
        let mut offset = 0;
        for target in targets {
            self.to.copy(target, Slice { offset, len: target.len, ..action });
            offset += target.len;
        }
        self.advance()?;
        let (before, after) = (std::mem::take(&mut self.to.before), std::mem::take(&mut self.to.after));
        let buffers = std::mem::take(&mut self.to.buffers);
        Ok(Around {
            buffers,
            before,
            observation: observation.buffer,
            after,
            action: action.buffer,
            limits: limits(plan),
            ports: ports(plan),
        })
    }

    /// Moves every state to its value of the next tick.
    fn advance(&mut self) -> Result<()> {
        let mut moves = Vec::new();
        let plan = self.plan;
        for (state, place) in plan.states.iter().zip(self.states.clone()) {
            moves.push((self.place(state.next)?, place));
        }
        for (output, place) in self.before.clone() {
            moves.push((self.output(output)?, place));
        }
        self.to.phase = Phase::After;
        moves.retain(|(from, to)| from.buffer != to.buffer);
        // A state that another one takes must still have this tick's value then.
        for (from, _) in &mut moves {
            if self.to.buffers.get(from.buffer).is_some_and(|buffer| buffer.lifetime == Lifetime::State) {
                *from = self.to.writable_copy(*from);
            }
        }
        for (from, to) in moves {
            self.to.copy(from, to);
        }
        Ok(())
    }

    /// Returns the place of a value; makes it, before the network if it does not depend on its output.
    pub(super) fn place(&mut self, index: ValueIndex) -> Result<Slice> {
        if let Some(place) = self.placed[index] {
            return Ok(place);
        }
        let phase = std::mem::replace(&mut self.to.phase, Phase::of(self.joined.depends[index]));
        let name = || self.plan.values[index].labels.first().map_or_else(String::new, |label| label.value.clone());
        let place = self.make(index).with_context(|| format!("value {:?}", name()))?;
        self.to.phase = phase;
        self.placed[index] = Some(place);
        Ok(place)
    }

    fn places(&mut self, indices: &[ValueIndex]) -> Result<Vec<Slice>> {
        indices.iter().map(|index| self.place(*index)).collect()
    }

    /// Returns the place of an output after its contract.
    fn output(&mut self, output: Output) -> Result<Slice> {
        if let Some(place) = find(&self.outputs, output) {
            return Ok(place);
        }
        let part = part(self.plan, output)?;
        let place = if has_weights(part) {
            let found = self.joined.outputs.iter().find(|(known, _)| *known == output);
            let span = found.context("an output of a network is not computed")?.1;
            self.to.phase = Phase::After;
            Slice { buffer: OUTPUT, offset: span.from, len: span.len }
        } else {
            let feeds = &self.plan.networks[output.0].feeds;
            let depends = |read: &usize| matches!(feeds[*read], Feed::Value(index) if self.joined.depends[index]);
            self.to.phase = Phase::of(part.reads.iter().any(depends));
            let mut read = Vec::new();
            for i in part.reads {
                read.push(match feeds[*i] {
                    Feed::Value(index) => self.place(index)?,
                    Feed::Before(before, _) => {
                        find(&self.before, (output.0, before)).context("a state has no place")?
                    }
                });
            }
            let observation = self.to.concatenated(&read);
            self.to.network(&part.policy.graph, observation)
        };
        let contract = &part.policy.contract;
        let len = place.len;
        let of = |array: &Option<Vec<f32>>, neutral: f32| array.clone().unwrap_or_else(|| vec![neutral; len]);
        let mut place = place;
        if contract.scale.is_some() || contract.offset.is_some() {
            let scaled = self.to.normalize(place, &vec![0.0; len], &of(&contract.scale, 1.0), f32::INFINITY);
            place = match &contract.offset {
                Some(offset) => self.to.plus(scaled, offset),
                None => scaled,
            };
        }
        if contract.low.is_some() || contract.high.is_some() {
            let low = self.to.constant(&of(&contract.low, f32::MIN));
            let high = self.to.constant(&of(&contract.high, f32::MAX));
            place = self.to.writable_copy(place);
            self.to.emit(OpKind::Clip, place, Some(low), Some(high), StepData::None);
        }
        self.outputs.push((output, place));
        Ok(place)
    }

    fn make(&mut self, index: ValueIndex) -> Result<Slice> {
        let plan = self.plan;
        match &plan.values[index].source {
            ValueSource::Input(i) => {
                let offset = plan.inputs[..*i].iter().map(|(_, len)| len).sum();
                Ok(Slice { buffer: 0, offset, len: plan.inputs[*i].1 })
            }
            ValueSource::State(i) => Ok(self.states[*i]),
            ValueSource::Clock(clock, of) => self.clock(clock, of),
            ValueSource::Motion { rows, lag, end } => self.motion(rows, *lag, *end),
            ValueSource::Output(network, output) => self.output((*network, *output)),
            ValueSource::Value(from, steps) => {
                let parts = self.places(from)?;
                let mut chain = Chain::of(self.to.concatenated(&parts));
                for step in steps {
                    let operands = self.operands(step, chain.len())?;
                    chain.step(&mut self.to, step, &operands)?;
                }
                Ok(chain.end(&mut self.to))
            }
        }
    }

    /// Emits a table's next row.
    fn row(&mut self, rows: &[Vec<f32>], first: usize, next: usize) -> (Slice, Slice) {
        let (value, count) = (self.to.value(rows[0].len()), self.to.state(1));
        let mut data = words(&[rows.len(), first, next, 0]);
        data.extend(rows.iter().flatten().map(|number| number.to_bits()));
        self.to.emit(OpKind::TableRow, value, None, Some(count), StepData::Words(data));
        (value, count)
    }

    fn clock(&mut self, clock: &Clock, of: &[ValueIndex]) -> Result<Slice> {
        if clock.wrap.is_none() && clock.restart_above.is_none() && clock.standing.is_none() {
            return Ok(self.time(clock));
        }
        let clock::Rows { rows, first, next } = clock::rows(clock)?;
        let rows: Vec<Vec<f32>> = rows.iter().map(|row| row.iter().map(|phase| *phase as f32).collect()).collect();
        let (value, count) = self.row(&rows, first, next);
        if let Some(standing) = &clock.standing {
            let parts = self.places(of)?;
            let read = self.to.concatenated(&parts);
            let mut data = words(&[read.len, parts.len()]);
            let squared = (standing.below * standing.below) as f32;
            ensure!(
                squared > 0.0 && squared.is_finite(),
                "standing.below = {} is too small or too large",
                standing.below
            );
            data.push(squared.to_bits());
            data.extend(standing.at.iter().map(|phase| (*phase as f32).to_bits()));
            data.extend(words(&parts.iter().map(|part| part.len).collect::<Vec<_>>()));
            self.to.emit(OpKind::Standstill, value, Some(read), Some(count), StepData::Words(data));
        }
        Ok(value)
    }

    /// Counts ticks, exactly up to 2^24, and multiplies them by the advance.
    fn time(&mut self, clock: &Clock) -> Slice {
        let (ticks, one) = (self.to.state(1), self.to.constant(&[1.0]));
        let before = clock.when == When::Before;
        if before {
            self.to.with(OpKind::Add, ticks, one);
        }
        let all = self.to.select(ticks, &vec![0; clock.start.len()]);
        let value = self.to.times(all, clock.advance as f32);
        let start: Vec<f32> = clock.start.iter().map(|phase| *phase as f32).collect();
        let value = if start.iter().any(|phase| *phase != 0.0) { self.to.plus(value, &start) } else { value };
        if !before {
            self.to.with(OpKind::Add, ticks, one);
        }
        value
    }

    fn motion(&mut self, array: &Array, lag: usize, end: End) -> Result<Slice> {
        let (count, len) = array.rows()?;
        let rows: Vec<Vec<f32>> =
            array.values.chunks_exact(len).map(|row| row.iter().map(|number| *number as f32).collect()).collect();
        let late = lag.saturating_add(count);
        ensure!(late <= usize::from(u16::MAX), "the motion has {count} rows and a lag of {lag}; give at most 65535");
        let rows: Vec<Vec<f32>> = (0..late).map(|tick| rows[tick.saturating_sub(lag)].clone()).collect();
        let next = if end == End::Repeat { lag } else { rows.len() - 1 };
        Ok(self.row(&rows, 0, next).0)
    }

    /// Returns the values that a step reads beside its own, each with `len` numbers.
    fn operands(&mut self, step: &PlannedOp, len: usize) -> Result<Vec<Slice>> {
        let mut operands = Vec::new();
        for index in step.read_values() {
            let place = self.place(index)?;
            operands.push(if place.len == len { place } else { self.to.select(place, &vec![0; len]) });
        }
        Ok(operands)
    }
}

/// Returns the limits of all targets, the largest numbers where one has none.
fn limits(plan: &Plan) -> Option<[Vec<f32>; 2]> {
    let of = |which: usize, none: f32| {
        let each = plan.targets.iter().flat_map(move |target| match &target.limits {
            Some(limits) => limits[which].iter().map(|limit| *limit as f32).collect(),
            None => vec![none; plan.values[target.value].labels.len()],
        });
        each.collect()
    };
    let limited = plan.targets.iter().any(|target| target.limits.is_some());
    limited.then(|| [of(0, f32::MIN), of(1, f32::MAX)])
}

/// Lists raw inputs and targets.
fn ports(plan: &Plan) -> Vec<NamedPort> {
    const UNLIMITED: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];
    let input = |(i, (name, len)): (usize, &(String, usize))| {
        let range = plan.ranges[i].map_or(UNLIMITED, |range| range.map(|limit| limit as f32));
        // Inputs are the first values of a plan.
        let value = &plan.values[i];
        let joints = value.labels.iter().filter(|_| value.joints.is_some());
        let names = joints.map(|label| label.element.clone()).collect();
        NamedPort { kind: PortKind::Input, name: name.clone(), names, len: *len, range }
    };
    let target = |target: &PlannedTarget| {
        let kind = match target.kind {
            TargetKind::Position => PortKind::Position,
            TargetKind::Velocity => PortKind::Velocity,
            TargetKind::Torque => PortKind::Torque,
        };
        let name = plan.names[target.value].clone();
        let len = plan.values[target.value].labels.len();
        NamedPort { kind, name, names: target.joints.clone(), len, range: UNLIMITED }
    };
    plan.inputs.iter().enumerate().map(input).chain(plan.targets.iter().map(target)).collect()
}

fn find(places: &[(Output, Slice)], output: Output) -> Option<Slice> {
    places.iter().find(|(known, _)| *known == output).map(|(_, place)| *place)
}
