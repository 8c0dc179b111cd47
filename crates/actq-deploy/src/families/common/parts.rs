//! A description under construction.

use actq::error::{Result, ensure};

use super::histories::Histories;
use crate::description::{
    Clock, Description, From, Gains, Input, Network, Numbers, Op, SCHEMA, State, Target, TargetKind, Value,
};

/// Stands for the policy's output until [`Parts::network`] knows its name.
pub(crate) const ACTION: &str = "policy.ACTION";

/// A description under construction.
#[derive(Debug)]
pub(crate) struct Parts {
    description: Description,
    /// Terms of the observation with the lengths of their histories.
    terms: Vec<(String, usize)>,
}

impl Parts {
    pub(crate) fn new(name: &str, rate_hz: f64) -> Self {
        let description = Description {
            schema: SCHEMA,
            name: name.to_owned(),
            rate_hz,
            action: ACTION.to_owned(),
            ..Description::default()
        };
        Self { description, terms: Vec::new() }
    }

    pub(crate) fn constant(&mut self, name: &str, numbers: Vec<f64>) {
        self.description.constants.insert(name.to_owned(), numbers);
    }

    /// Adds a constant whose numbers the bundle has rounded by at most `rounding`.
    pub(crate) fn rounded_constant(&mut self, name: &str, numbers: Vec<f64>, rounding: f64) {
        self.constant(name, numbers);
        if rounding > 0.0 {
            self.description.rounding.insert(name.to_owned(), rounding);
        }
    }

    /// Returns the rounding of a constant.
    pub(crate) fn rounding(&self, name: &str) -> f64 {
        self.description.rounding.get(name).copied().unwrap_or(0.0)
    }

    /// Adds a raw input, unless it is there.
    pub(crate) fn raw(&mut self, name: &str, len: usize, unit: &str) {
        if self.description.inputs.iter().all(|input| input.name != name) {
            let unit = (!unit.is_empty()).then(|| unit.to_owned());
            let input = Input { name: name.to_owned(), len: Some(len), joints: None, unit, range: None };
            self.description.inputs.push(input);
        }
    }

    /// Adds a raw input in the order of a list of joints, unless it is there.
    pub(crate) fn raw_joints(&mut self, name: &str, joints: &str, unit: &str) {
        if self.description.inputs.iter().any(|input| input.name == name) {
            return;
        }
        let unit = (!unit.is_empty()).then(|| unit.to_owned());
        let joints = Some(joints.to_owned());
        self.description.inputs.push(Input { name: name.to_owned(), len: None, joints, unit, range: None });
    }

    pub(crate) fn joints(&mut self, order: &str, names: Vec<String>) {
        self.description.joints.insert(order.to_owned(), names);
    }

    /// Adds a raw input for the term of its name; returns the operations on it, which are none.
    pub(crate) fn input(&mut self, name: &str, len: usize, unit: &str) -> Vec<Op> {
        self.input_as(name, name, len, unit)
    }

    /// Adds a raw input for a term.
    pub(crate) fn input_as(&mut self, term: &str, name: &str, len: usize, unit: &str) -> Vec<Op> {
        self.raw(name, len, unit);
        self.begin(term, name);
        Vec::new()
    }

    /// Adds a state that starts at zero, for the term of its name.
    pub(crate) fn state_term(&mut self, name: &str, len: usize, next: &str) -> Vec<Op> {
        let state = State { name: format!("{name}_state"), len, start: Numbers::default(), next: next.to_owned() };
        self.begin(name, &state.name.clone());
        self.description.states.push(state);
        Vec::new()
    }

    /// Adds a state that starts at zero.
    pub(crate) fn state(&mut self, name: &str, len: usize, next: &str) {
        let state = State { name: name.to_owned(), len, start: Numbers::default(), next: next.to_owned() };
        self.description.states.push(state);
    }

    /// Adds a state that starts at given numbers.
    pub(crate) fn state_from(&mut self, name: &str, len: usize, start: Numbers, next: &str) {
        let state = State { name: name.to_owned(), len, start, next: next.to_owned() };
        self.description.states.push(state);
    }

    /// Adds numbers as a value: a state that stays as it starts.
    pub(crate) fn constant_value(&mut self, name: &str, numbers: Vec<f64>) {
        let (len, start) = (numbers.len(), Numbers::Each(numbers));
        self.description.states.push(State { name: name.to_owned(), len, start, next: name.to_owned() });
    }

    pub(crate) fn clock(&mut self, clock: Clock) {
        self.description.clocks.push(clock);
    }

    /// Begins a term that is made of another value.
    pub(crate) fn begin(&mut self, term: &str, from: &str) {
        let name = self.term_name(term);
        self.description.values.push(Value { name, from: From::One(from.to_owned()), ops: Vec::new() });
    }

    /// Returns the name of a term's value, which differs from those of inputs.
    fn term_name(&self, term: &str) -> String {
        let taken = self.description.inputs.iter().any(|input| input.name == term);
        if taken { format!("{term}_term") } else { term.to_owned() }
    }

    /// Ends the term that was begun last; `length` frames of it are observed. Returns the name of its value.
    pub(crate) fn term(&mut self, ops: Vec<Op>, length: usize) -> String {
        let Some(value) = self.description.values.last_mut() else { return String::new() };
        value.ops = ops;
        self.terms.push((value.name.clone(), length));
        value.name.clone()
    }

    /// Makes the observation of the terms and their histories.
    pub(crate) fn observe(&mut self, histories: &Histories) -> Result<()> {
        ensure!(!self.terms.is_empty(), "there are no terms of an observation");
        let names: Vec<String> = self.terms.iter().map(|(name, _)| name.clone()).collect();
        let mut observation = Value { name: "observation".to_owned(), from: From::Many(names), ops: Vec::new() };
        if histories.by_term {
            for (name, length) in self.terms.iter().filter(|(_, length)| *length > 1) {
                let value = self.description.values.iter_mut().find(|value| value.name == *name);
                value.into_iter().for_each(|value| value.ops.push(Op::History(histories.spec(*length))));
            }
        } else {
            let length = self.terms[0].1;
            ensure!(
                self.terms.iter().all(|(_, other)| *other == length),
                "the terms' histories have different lengths, which is not known frame by frame"
            );
            observation.ops.extend((length > 1).then(|| Op::History(histories.spec(length))));
        }
        self.description.values.push(observation);
        Ok(())
    }

    /// Adds an operation to the observation that was made.
    pub(crate) fn observed(&mut self, op: Op) {
        self.description.values.last_mut().into_iter().for_each(|value| value.ops.push(op.clone()));
    }

    pub(crate) fn value(&mut self, name: &str, from: &str, ops: Vec<Op>) {
        self.description.values.push(Value { name: name.to_owned(), from: From::One(from.to_owned()), ops });
    }

    /// Adds a value made of several.
    pub(crate) fn values(&mut self, name: &str, from: &[&str]) {
        let from = From::Many(from.iter().map(|&name| name.to_owned()).collect());
        self.description.values.push(Value { name: name.to_owned(), from, ops: Vec::new() });
    }

    /// Adds a network that reads one value by its only input; returns the name of its only output's value.
    pub(crate) fn network_of(&mut self, name: &str, ports: &(String, String), file: &str, value: &str) -> String {
        self.description.networks.push(Network {
            name: name.to_owned(),
            file: file.to_owned(),
            inputs: [(ports.0.clone(), value.to_owned())].into(),
            states: [].into(),
        });
        format!("{name}.{}", ports.1)
    }

    /// Adds a network with several inputs.
    pub(crate) fn wired(&mut self, network: Network) {
        self.description.networks.push(network);
    }

    /// Adds the policy's network, which reads the observation, and its action's name everywhere.
    pub(crate) fn network(&mut self, file: &str, input: &str, output: &str) {
        let action = self.network_of("policy", &(input.to_owned(), output.to_owned()), file, "observation");
        self.act(&action);
    }

    /// Names the policy's output.
    pub(crate) fn act(&mut self, action: &str) {
        self.description.action = action.to_owned();
    }

    pub(crate) fn target(&mut self, kind: TargetKind, value: &str) {
        self.description.targets.push(Target { kind, value: value.to_owned(), joints: None, limits: None });
    }

    /// Adds a target in the order of a list of joints.
    pub(crate) fn target_joints(&mut self, kind: TargetKind, value: &str, joints: &str) {
        self.description.targets.push(Target {
            kind,
            value: value.to_owned(),
            joints: Some(joints.to_owned()),
            limits: None,
        });
    }

    /// Limits the target that was added last to these lowest and highest values; an infinite one is no limit.
    pub(crate) fn limit(&mut self, limits: [Vec<f64>; 2]) {
        let finite = |bound: &f64| bound.clamp(f64::from(f32::MIN), f64::from(f32::MAX));
        let limits = limits.map(|each| Numbers::Each(each.iter().map(finite).collect()));
        if let Some(target) = self.description.targets.last_mut() {
            target.limits = Some(limits);
        }
    }

    pub(crate) fn gains(&mut self, gains: Gains) {
        self.description.gains = Some(gains);
    }

    pub(crate) fn finish(self) -> Description {
        let mut description = self.description;
        let action = description.action.clone();
        let named = |name: &mut String| {
            if name == ACTION {
                name.clone_from(&action);
            }
        };
        description.states.iter_mut().for_each(|state| named(&mut state.next));
        for value in &mut description.values {
            match &mut value.from {
                From::One(name) => named(name),
                From::Many(names) => names.iter_mut().for_each(named),
            }
        }
        description
    }
}
