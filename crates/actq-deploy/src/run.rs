//! A description's reference execution, tick by tick in f64; its networks compute in f32.

use std::f64::consts::PI;

use actq::error::{Context as _, Result, bail, ensure};
use actq::random::Random;
use actq_kernels::math::ORIENTATION;
use libm::{cos, sin};

use crate::clock::Phases;
use crate::description::{End, Op, Orientation, TargetKind};
use crate::history::Frames;
use crate::plan::{Arg, Feed, Plan, PlannedOp, PlannedTarget, TickStep, ValueSource};

/// Values of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// All inputs of all networks, one after the other.
    pub observation: Vec<f64>,
    /// The action as the network gives it.
    pub action: Vec<f64>,
    /// Targets for the robot's joints.
    pub targets: Vec<(TargetKind, Vec<f64>)>,
}

/// Executes a plan tick by tick.
pub struct Runner {
    plan: Plan,
    values: Vec<Vec<f64>>,
    states: Vec<Vec<f64>>,
    outputs: Vec<Vec<Vec<f32>>>,
    /// Clocks and histories by value, the latter by their operation, too.
    clocks: Vec<Option<Phases>>,
    histories: Vec<Vec<Option<Frames>>>,
    tick: usize,
    noise: Option<Noise>,
    /// Largest value of each network's outputs, also in runs before a reset.
    largest: Vec<Vec<f32>>,
}

/// Random errors of a run, to see what they grow to.
#[derive(Clone, Debug)]
pub struct Noise {
    /// The generator of the errors.
    pub random: Random,
    /// Largest error of a value, as a share of it.
    pub of_values: f64,
    /// Largest error of a network's output, as a share of its largest value in all ticks so far.
    pub of_outputs: f64,
}

impl Noise {
    fn on_values(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|x| *x += *x * self.of_values * f64::from(self.random.unit()));
    }

    fn on_output(&mut self, output: &mut [f32], largest: f32) {
        output.iter_mut().for_each(|x| *x += largest * self.of_outputs as f32 * self.random.unit());
    }
}

impl Runner {
    /// Starts at the state after a reset.
    pub fn new(plan: Plan) -> Self {
        let clock = |source: &ValueSource| {
            if let ValueSource::Clock(clock, _) = source { Some(Phases::new(clock.clone())) } else { None }
        };
        let frames = |step: &PlannedOp| if let Op::History(spec) = step { Some(Frames::new(*spec)) } else { None };
        let histories = |source: &ValueSource| match source {
            ValueSource::Value(_, steps) => steps.iter().map(frames).collect(),
            _ => Vec::new(),
        };
        let mut runner = Self {
            values: vec![Vec::new(); plan.values.len()],
            clocks: plan.values.iter().map(|value| clock(&value.source)).collect(),
            histories: plan.values.iter().map(|value| histories(&value.source)).collect(),
            states: Vec::new(),
            outputs: Vec::new(),
            tick: 0,
            noise: None,
            largest: plan.networks.iter().map(|network| vec![0.0; network.compute.outputs().len()]).collect(),
            plan,
        };
        runner.reset();
        runner
    }

    /// Returns its plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns to the state of the start, and runs with these errors from there on.
    pub fn reset_with(&mut self, noise: Option<Noise>) {
        self.noise = noise;
        self.reset();
    }

    /// Returns to the state of the start.
    pub fn reset(&mut self) {
        self.states = self.plan.states.iter().map(|state| state.start.clone()).collect();
        self.clocks.iter_mut().flatten().for_each(Phases::reset);
        self.histories.iter_mut().flatten().flatten().for_each(Frames::reset);
        for network in &mut self.plan.networks {
            network.compute.reset();
        }
        let zeros = |lens: &[usize]| lens.iter().map(|len| vec![0.0; *len]).collect();
        self.outputs = self.plan.networks.iter().map(|network| zeros(network.compute.outputs())).collect();
        self.tick = 0;
    }

    /// Computes a tick from the raw inputs, in the order and the lengths of [`Plan::inputs`].
    ///
    /// # Errors
    ///
    /// If a quaternion is not an orientation: its length is not near 1. An image's step fails then, too.
    ///
    /// # Panics
    ///
    /// If their number or a length is another.
    pub fn step(&mut self, raw: &[Vec<f64>]) -> Result<Tick> {
        self.step_after(raw, None)
    }

    /// As [`Self::step`], with a recorded action in place of the network's for all that follows from it: targets, and
    /// what is fed back. The tick has the network's own action.
    ///
    /// # Errors
    ///
    /// As [`Self::step`].
    ///
    /// # Panics
    ///
    /// As [`Self::step`], or if the recorded action has another length.
    pub fn step_after(&mut self, raw: &[Vec<f64>], recorded: Option<&[f64]>) -> Result<Tick> {
        assert!(
            raw.iter().map(Vec::len).eq(self.plan.inputs.iter().map(|(_, len)| *len)),
            "raw inputs of other lengths"
        );
        let mut observations = vec![Vec::new(); self.plan.networks.len()];
        let mut action = Vec::new();
        for i in 0..self.plan.order.len() {
            match self.plan.order[i] {
                TickStep::Value(index) => {
                    self.values[index] = self.make(index, raw)?;
                    if let Some(noise) = &mut self.noise {
                        noise.on_values(&mut self.values[index]);
                    }
                    if index == self.plan.action {
                        action.clone_from(&self.values[index]);
                        if let Some(recorded) = recorded {
                            assert_eq!(recorded.len(), action.len(), "a recorded action of another length");
                            self.values[index] = recorded.to_vec();
                        }
                    }
                }
                TickStep::Network(network) => observations[network] = self.run(network),
            }
        }
        self.states = self.plan.states.iter().map(|state| self.values[state.next].clone()).collect();
        self.tick += 1;
        Ok(Tick { observation: observations.concat(), action, targets: self.targets() })
    }

    fn targets(&self) -> Vec<(TargetKind, Vec<f64>)> {
        let limited = |target: &PlannedTarget| {
            let mut values = self.values[target.value].clone();
            if let Some([low, high]) = &target.limits {
                values.iter_mut().zip(low.iter().zip(high)).for_each(|(x, (low, high))| *x = x.clamp(*low, *high));
            }
            (target.kind, values)
        };
        self.plan.targets.iter().map(limited).collect()
    }

    fn make(&mut self, index: usize, raw: &[Vec<f64>]) -> Result<Vec<f64>> {
        Ok(match &self.plan.values[index].source {
            ValueSource::Input(i) => raw[*i].clone(),
            ValueSource::State(i) => self.states[*i].clone(),
            ValueSource::Clock(_, of) => {
                let norms: Vec<f64> = of.iter().map(|value| norm(&self.values[*value])).collect();
                self.clocks[index].as_mut().map_or_else(Vec::new, |phases| phases.step(&norms))
            }
            ValueSource::Motion { rows, lag, end } => {
                let (count, len) = (rows.shape[0], rows.values.len() / rows.shape[0]);
                let row = self.tick.saturating_sub(*lag);
                let row = if *end == End::Repeat { row % count } else { row.min(count - 1) };
                rows.values[row * len..][..len].to_vec()
            }
            ValueSource::Output(network, output) => {
                self.outputs[*network][*output].iter().map(|value| f64::from(*value)).collect()
            }
            ValueSource::Value(from, steps) => {
                let mut value: Vec<f64> = from.iter().flat_map(|index| self.values[*index].iter().copied()).collect();
                for (step, frames) in steps.iter().zip(&mut self.histories[index]) {
                    value = match frames {
                        Some(frames) => frames.step(&value),
                        None => apply(step, value, &self.values).with_context(|| self.plan.names[index].clone())?,
                    };
                }
                value
            }
        })
    }

    /// Runs a network; returns its inputs, one after the other.
    fn run(&mut self, index: usize) -> Vec<f64> {
        let network = &mut self.plan.networks[index];
        let of = |feed: &Feed| match feed {
            Feed::Value(index) => self.values[*index].iter().map(|value| *value as f32).collect(),
            Feed::Before(output, _) => self.outputs[index][*output].clone(),
        };
        let inputs: Vec<Vec<f32>> = network.feeds.iter().map(of).collect();
        self.outputs[index] = network.compute.step(&inputs);
        for (output, largest) in self.outputs[index].iter_mut().zip(&mut self.largest[index]) {
            *largest = output.iter().fold(*largest, |most, x| most.max(x.abs()));
            if let Some(noise) = &mut self.noise {
                noise.on_output(output, *largest);
            }
        }
        inputs.into_iter().flatten().map(f64::from).collect()
    }
}

fn norm(value: &[f64]) -> f64 {
    value.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Applies an operation that keeps no state.
fn apply(step: &PlannedOp, mut value: Vec<f64>, values: &[Vec<f64>]) -> Result<Vec<f64>> {
    let mut with = |arg: &Arg, f: fn(f64, f64) -> f64| {
        let other = match arg {
            Arg::Numbers(numbers) => numbers,
            Arg::Value(index) => &values[*index],
        };
        for (i, x) in value.iter_mut().enumerate() {
            *x = f(*x, other[if other.len() == 1 { 0 } else { i }]);
        }
    };
    match step {
        Op::Select(places) => return Ok(places.iter().map(|place| value[*place]).collect()),
        Op::Place(places) => {
            let mut placed = vec![0.0; value.len()];
            places.iter().zip(&value).for_each(|(place, x)| placed[*place] = *x);
            return Ok(placed);
        }
        Op::Add(arg) => with(arg, |x, y| x + y),
        Op::Subtract(arg) => with(arg, |x, y| x - y),
        Op::Scale(arg) => with(arg, |x, y| x * y),
        Op::Divide(arg) => with(arg, |x, y| x / y),
        Op::Clip([low, high]) => {
            with(low, |x, y| if x < y { y } else { x });
            with(high, |x, y| if x > y { y } else { x });
        }
        Op::Wrap => value.iter_mut().for_each(|x| *x = (*x + PI).rem_euclid(2.0 * PI) - PI),
        Op::Sin => value.iter_mut().for_each(|x| *x = sin(*x)),
        Op::Cos => value.iter_mut().for_each(|x| *x = cos(*x)),
        Op::Norm => return Ok(vec![norm(&value)]),
        Op::Gravity(orientation) => return gravity(*orientation, &value),
        // A history has a state.
        Op::History(_) => {}
    }
    Ok(value)
}

/// Returns the direction of gravity, (0, 0, -1) in the world, in the body's frame.
fn gravity(orientation: Orientation, value: &[f64]) -> Result<Vec<f64>> {
    let [w, x, y, z] = match (orientation, value) {
        (Orientation::Wxyz, [w, x, y, z]) | (Orientation::Xyzw, [x, y, z, w]) => {
            let length = norm(value);
            ensure!(
                (f64::from(*ORIENTATION.start())..=f64::from(*ORIENTATION.end())).contains(&(length * length)),
                "the quaternion {value:?} has length {length:.3} and is not an orientation; give one of length 1"
            );
            [w / length, x / length, y / length, z / length]
        }
        (Orientation::Rpy, [roll, pitch, _]) => {
            return Ok(vec![sin(*pitch), -sin(*roll) * cos(*pitch), -cos(*roll) * cos(*pitch)]);
        }
        _ => bail!("{} values are no orientation", value.len()),
    };
    Ok(vec![2.0 * (w * y - x * z), -2.0 * (y * z + w * x), -(1.0 - 2.0 * (x * x + y * y))])
}
