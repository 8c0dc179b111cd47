//! What readers share: a description in the making.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;
use actq_onnx::Signature;

use crate::description::{
    Clock, Description, Fill, First, From, Gains, History, Input, Network, Numbers, Op, Orientation, SCHEMA, State,
    Target, TargetKind, Value,
};
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::{Data, Node};

/// Stands for the policy's output until [`Parts::network`] knows its name.
pub(super) const ACTION: &str = "policy.ACTION";

/// How a family keeps histories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Histories {
    /// All frames of a term, then the next term; otherwise all terms of a frame.
    pub(super) by_term: bool,
    pub(super) first: First,
    pub(super) fill: Fill,
    /// Ticks from a frame to the next.
    pub(super) stride: usize,
}

impl Histories {
    /// Asks for the rules history.layout, history.first and history.fill.
    pub(super) fn of(facts: &mut Facts) -> Result<Self> {
        let layout: Option<String> = facts.find("history.layout")?;
        let by_term = match layout.as_deref() {
            Some("term") => true,
            Some("frame") | None => false,
            Some(other) => bail!("history.layout = {other:?}: give \"term\" or \"frame\""),
        };
        Ok(Self { by_term, first: facts.get("history.first")?, fill: facts.get("history.fill")?, stride: 1 })
    }

    pub(super) fn spec(&self, length: usize) -> History {
        History { length, stride: self.stride, first: self.first, fill: self.fill, current: true }
    }
}

/// A description in the making.
#[derive(Debug)]
pub(super) struct Parts {
    description: Description,
    /// Terms of the observation with the lengths of their histories.
    terms: Vec<(String, usize)>,
}

impl Parts {
    pub(super) fn new(name: &str, rate_hz: f64) -> Self {
        let description = Description {
            schema: SCHEMA,
            name: name.to_owned(),
            rate_hz,
            action: ACTION.to_owned(),
            joints: [].into(),
            constants: [].into(),
            inputs: Vec::new(),
            states: Vec::new(),
            clocks: Vec::new(),
            motions: Vec::new(),
            values: Vec::new(),
            networks: Vec::new(),
            targets: Vec::new(),
            gains: None,
        };
        Self { description, terms: Vec::new() }
    }

    pub(super) fn constant(&mut self, name: &str, numbers: Vec<f64>) {
        self.description.constants.insert(name.to_owned(), numbers);
    }

    /// Adds a raw input, unless it is there.
    pub(super) fn raw(&mut self, name: &str, len: usize, unit: &str) {
        if self.description.inputs.iter().all(|input| input.name != name) {
            let unit = (!unit.is_empty()).then(|| unit.to_owned());
            let input = Input { name: name.to_owned(), len: Some(len), joints: None, unit, range: None };
            self.description.inputs.push(input);
        }
    }

    /// Adds a raw input in the order of a list of joints.
    pub(super) fn raw_joints(&mut self, name: &str, joints: &str, unit: &str) {
        let unit = (!unit.is_empty()).then(|| unit.to_owned());
        let joints = Some(joints.to_owned());
        self.description.inputs.push(Input { name: name.to_owned(), len: None, joints, unit, range: None });
    }

    /// Adds a list of joint names.
    pub(super) fn joints(&mut self, order: &str, names: Vec<String>) {
        self.description.joints.insert(order.to_owned(), names);
    }

    /// Adds a raw input for the term of its name; returns the operations on it, which are none.
    pub(super) fn input(&mut self, name: &str, len: usize, unit: &str) -> Vec<Op> {
        self.input_as(name, name, len, unit)
    }

    /// Adds a raw input for a term.
    pub(super) fn input_as(&mut self, term: &str, name: &str, len: usize, unit: &str) -> Vec<Op> {
        self.raw(name, len, unit);
        self.begin(term, name);
        Vec::new()
    }

    /// Adds a state that starts at zero, for the term of its name.
    pub(super) fn state(&mut self, name: &str, len: usize, next: &str) -> Vec<Op> {
        let state = State { name: format!("{name}_state"), len, start: Numbers::default(), next: next.to_owned() };
        self.begin(name, &state.name.clone());
        self.description.states.push(state);
        Vec::new()
    }

    /// Adds a state that starts at zero.
    pub(super) fn kept(&mut self, name: &str, len: usize, next: &str) {
        let state = State { name: name.to_owned(), len, start: Numbers::default(), next: next.to_owned() };
        self.description.states.push(state);
    }

    /// Adds a state that starts at given numbers.
    pub(super) fn kept_from(&mut self, name: &str, len: usize, start: Numbers, next: &str) {
        let state = State { name: name.to_owned(), len, start, next: next.to_owned() };
        self.description.states.push(state);
    }

    /// Adds numbers as a value: a state that stays as it starts.
    pub(super) fn unchanged(&mut self, name: &str, numbers: Vec<f64>) {
        let (len, start) = (numbers.len(), Numbers::Each(numbers));
        self.description.states.push(State { name: name.to_owned(), len, start, next: name.to_owned() });
    }

    pub(super) fn clock(&mut self, clock: Clock) {
        self.description.clocks.push(clock);
    }

    /// Begins a term that is made of another value.
    pub(super) fn begin(&mut self, term: &str, from: &str) {
        let name = self.term_name(term);
        self.description.values.push(Value { name, from: From::One(from.to_owned()), ops: Vec::new() });
    }

    /// Returns the name of a term's value, which differs from those of inputs.
    fn term_name(&self, term: &str) -> String {
        let taken = self.description.inputs.iter().any(|input| input.name == term);
        if taken { format!("{term}_term") } else { term.to_owned() }
    }

    /// Ends the term that was begun last; `length` frames of it are observed. Returns the name of its value.
    pub(super) fn term(&mut self, ops: Vec<Op>, length: usize) -> String {
        let Some(value) = self.description.values.last_mut() else { return String::new() };
        value.ops = ops;
        self.terms.push((value.name.clone(), length));
        value.name.clone()
    }

    /// Makes the observation of the terms and their histories.
    pub(super) fn observe(&mut self, histories: &Histories) -> Result<()> {
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

    pub(super) fn value(&mut self, name: &str, from: &str, ops: Vec<Op>) {
        self.description.values.push(Value { name: name.to_owned(), from: From::One(from.to_owned()), ops });
    }

    /// Adds a value made of several.
    pub(super) fn values(&mut self, name: &str, from: &[&str]) {
        let from = From::Many(from.iter().map(|&name| name.to_owned()).collect());
        self.description.values.push(Value { name: name.to_owned(), from, ops: Vec::new() });
    }

    /// Adds a network that reads one value by its only input; returns the name of its only output's value.
    pub(super) fn network_of(&mut self, name: &str, ports: &(String, String), file: &str, value: &str) -> String {
        self.description.networks.push(Network {
            name: name.to_owned(),
            file: file.to_owned(),
            inputs: [(ports.0.clone(), value.to_owned())].into(),
            states: [].into(),
        });
        format!("{name}.{}", ports.1)
    }

    /// Adds a network with several inputs.
    pub(super) fn wired(&mut self, network: Network) {
        self.description.networks.push(network);
    }

    /// Adds the policy's network, which reads the observation, and its action's name everywhere.
    pub(super) fn network(&mut self, file: &str, input: &str, output: &str) {
        self.description.networks.push(Network {
            name: "policy".to_owned(),
            file: file.to_owned(),
            inputs: [(input.to_owned(), "observation".to_owned())].into(),
            states: [].into(),
        });
        self.act(&format!("policy.{output}"));
    }

    /// Names the policy's output.
    pub(super) fn act(&mut self, action: &str) {
        self.description.action = action.to_owned();
    }

    pub(super) fn target(&mut self, kind: TargetKind, value: &str) {
        self.description.targets.push(Target { kind, value: value.to_owned(), joints: None, limits: None });
    }

    /// Adds a target in the order of a list of joints.
    pub(super) fn target_joints(&mut self, kind: TargetKind, value: &str, joints: &str) {
        self.description.targets.push(Target {
            kind,
            value: value.to_owned(),
            joints: Some(joints.to_owned()),
            limits: None,
        });
    }

    pub(super) fn gains(&mut self, gains: Gains) {
        self.description.gains = Some(gains);
    }

    pub(super) fn finish(self) -> Description {
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

/// Returns the raw input that gives the direction of gravity by a rule, its length, and the operations on it. `open` stands
/// for the rule while it is a question, and `quaternion` is the family's name of an orientation.
pub(super) fn given_gravity(
    facts: &mut Facts,
    rule: &str,
    open: &str,
    quaternion: &'static str,
) -> Result<(&'static str, usize, Vec<Op>)> {
    let given: Option<String> = facts.find(rule)?;
    Ok(match given.as_deref().unwrap_or(open) {
        "vector" => ("projected_gravity", 3, Vec::new()),
        "wxyz" => (quaternion, 4, vec![Op::Gravity(Orientation::Wxyz)]),
        "xyzw" => (quaternion, 4, vec![Op::Gravity(Orientation::Xyzw)]),
        "rpy" => ("rpy", 3, vec![Op::Gravity(Orientation::Rpy)]),
        other => bail!("{rule} = {other:?}: give \"vector\", \"wxyz\", \"xyzw\" or \"rpy\""),
    })
}

/// Begins the term projected_gravity, by a rule.
pub(super) fn gravity(parts: &mut Parts, rule: &str, facts: &mut Facts) -> Result<Vec<Op>> {
    let (name, len, ops) = given_gravity(facts, rule, "vector", "orientation")?;
    parts.input_as("projected_gravity", name, len, "");
    Ok(ops)
}

/// Reads a number of values or frames.
pub(super) fn count(node: &Node) -> Option<usize> {
    let number = node.number()?;
    (number >= 0.0 && number.fract() == 0.0 && number < 1e5).then_some(number as usize)
}

/// Reads a list of numbers of values or frames.
pub(super) fn counts(node: &Node) -> Option<Vec<usize>> {
    node.numbers()?;
    node.items().iter().map(count).collect()
}

/// The graph's input and output.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) file: String,
    pub(super) input: String,
    pub(super) input_len: usize,
    pub(super) output: String,
    pub(super) actions: usize,
}

impl Graph {
    pub(super) fn of(file: &str, signature: &Signature) -> Result<Self> {
        let choose = |ports: &[(String, Option<usize>)], kind: &str, usual: &str| -> Result<(String, usize)> {
            let port = match ports {
                [only] => Some(only),
                _ => ports.iter().find(|(name, _)| name == usual),
            };
            let shown = || ports.iter().map(|(name, _)| printable(name)).collect::<Vec<_>>().join(", ");
            let (name, len) = port.with_context(|| format!("{file}: none of its {kind} is {usual:?}: {}", shown()))?;
            let len = len.filter(|len| *len > 0);
            let len = len.with_context(|| format!("{file}: the length of {:?} is not given", printable(name)))?;
            Ok((name.clone(), len))
        };
        let (input, input_len) = choose(&signature.inputs, "inputs", "obs")?;
        let (output, actions) = choose(&signature.outputs, "outputs", "actions")?;
        Ok(Self { file: file.to_owned(), input, input_len, output, actions })
    }
}

/// Takes an ONNX file's metadata as a document of texts.
pub(super) fn metadata_document(file: &str, metadata: &BTreeMap<String, String>) -> Document {
    let entry =
        |(key, text): (&String, &String)| (key.clone(), Node { line: 1, data: Data::Scalar(text.clone(), true) });
    let data = Data::Map(metadata.iter().map(entry).collect());
    Document::of(&format!("{file} metadata"), Node { line: 1, data })
}

/// Refuses names that are empty, occur twice, or have characters that a report cannot show.
pub(super) fn check_names(names: &[String], at: &str) -> Result<()> {
    for (i, name) in names.iter().enumerate() {
        let shown = printable(name);
        ensure!(!name.is_empty() && shown == *name, "{at}: {shown:?} is not a name");
        ensure!(!names[..i].contains(name), "{at}: {name:?} occurs twice");
    }
    Ok(())
}

/// Reads a list with commas between its names.
pub(super) fn names(meta: &Document, key: &str) -> Result<Vec<String>> {
    let text = meta.need(key, "names with commas between them", Node::text)?;
    let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
    for (i, name) in names.iter().enumerate() {
        ensure!(!name.is_empty(), "{}: name {i} is empty", meta.at(key));
        ensure!(!names[..i].contains(name), "{}: {:?} occurs twice", meta.at(key), printable(name));
    }
    Ok(names)
}

/// Reads a list with commas between its numbers.
pub(super) fn numbers(meta: &Document, key: &str) -> Result<Option<Vec<f64>>> {
    let Some(text) = meta.maybe(key, "a text", Node::text)? else { return Ok(None) };
    let number = |word: &str| {
        let number: Option<f64> = word.trim().parse().ok().filter(|number: &f64| number.is_finite());
        number.with_context(|| format!("{}: {:?} is not a finite number", meta.at(key), printable(word.trim())))
    };
    text.split(',').map(number).collect::<Result<_>>().map(Some)
}
