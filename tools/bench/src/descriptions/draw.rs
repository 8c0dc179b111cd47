//! Random descriptions.

use std::collections::BTreeMap;

use actq::random::Random;
use actq_deploy::description::{
    Clock, Description, End, Fill, First, From, History, Input, Motion, Network, Numbers, Op, Operand, Order,
    Orientation, SCHEMA, Standing, State, Target, TargetKind, Value, When,
};

use super::network::File;

/// Most numbers of a value.
const MOST: usize = 40;
/// Joints of two orders.
const JOINTS: [&str; 3] = ["a", "b", "c"];

/// A value that others may read.
#[derive(Clone, Debug)]
struct Drawn {
    name: String,
    len: usize,
    /// It may be an input of a network: it depends on none, or is the output of one.
    is_fed: bool,
}

/// A description under construction, and its files.
#[derive(Debug)]
pub(super) struct Draw {
    random: Random,
    values: Vec<Drawn>,
    pub(super) description: Description,
    pub(super) files: Vec<(String, Vec<u8>)>,
}

impl Draw {
    pub(super) fn description(seed: u64) -> Self {
        let name = format!("seed {seed}");
        let description = Description { schema: SCHEMA, name, rate_hz: 50.0, ..Description::default() };
        let mut draw = Self { random: Random::new(seed), values: Vec::new(), description, files: Vec::new() };
        draw.inputs();
        draw.states();
        draw.times(2);
        for _ in 0..draw.below(4) {
            draw.value();
        }
        for _ in 0..1 + draw.below(3) {
            draw.network();
            draw.times(1);
            for _ in 0..draw.below(4) {
                draw.value();
            }
        }
        draw.targets();
        draw.next_states();
        draw
    }

    fn below(&mut self, n: usize) -> usize {
        self.random.below(n)
    }

    fn is_one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// Draws a number from -2 to 2 with two decimals.
    fn number(&mut self) -> f64 {
        (200.0 * f64::from(self.random.unit())).round() / 100.0
    }

    fn numbers(&mut self, len: usize) -> Vec<f64> {
        (0..len).map(|_| self.number()).collect()
    }

    fn add(&mut self, name: &str, len: usize, is_fed: bool) {
        self.values.push(Drawn { name: name.to_owned(), len, is_fed });
    }

    fn any(&mut self) -> Drawn {
        let at = self.below(self.values.len());
        self.values[at].clone()
    }

    fn name(&self, of: &str) -> String {
        format!("{of}{}", self.values.len())
    }

    fn inputs(&mut self) {
        let orders = [("robot", [0, 1, 2]), ("policy", [2, 0, 1])];
        self.description.joints =
            orders.map(|(name, order)| (name.to_owned(), order.map(|i| JOINTS[i].to_owned()).to_vec())).into();
        self.description.constants = [("default".to_owned(), self.numbers(3))].into();
        let mut input = |name: &str, len: usize, is_joints: bool, range| {
            let (given, joints) = if is_joints { (None, Some("robot".to_owned())) } else { (Some(len), None) };
            self.description.inputs.push(Input { name: name.to_owned(), len: given, joints, unit: None, range });
            self.add(name, len, true);
        };
        input("q", 3, true, None);
        input("quaternion", 4, false, None);
        input("angles", 3, false, None);
        input("command", 1, false, Some([0.25, 0.5]));
        let len = 1 + self.below(5);
        if len != 4 {
            self.description.inputs.push(Input {
                name: "x".to_owned(),
                len: Some(len),
                joints: None,
                unit: None,
                range: None,
            });
            self.add("x", len, true);
        }
    }

    fn states(&mut self) {
        for i in 0..self.below(4) {
            let (name, len) = (format!("state{i}"), 1 + self.below(4));
            let start = [Numbers::All(0.0), Numbers::Each(self.numbers(len))][self.below(2)].clone();
            self.description.states.push(State { name: name.clone(), len, start, next: String::new() });
            self.add(&name, len, true);
        }
    }

    /// Gives each state its next value: any value, or one with operations of its own.
    fn next_states(&mut self) {
        for i in 0..self.description.states.len() {
            let State { name, len, .. } = self.description.states[i].clone();
            let same: Vec<String> = self.values.iter().filter(|v| v.len == len).map(|v| v.name.clone()).collect();
            let next = self.name("next");
            // A state must not grow without end.
            let (bound, from) = (Op::Clip([-4.0, 4.0].map(Operand::Number)), self.any());
            match self.below(4) {
                0 => self.description.states[i].next = same[self.below(same.len())].clone(),
                1 => {
                    let decay = Op::Scale(Operand::Number(0.9));
                    let step = self.operand(len);
                    let ops = vec![decay, Op::Add(step), bound];
                    self.end_value(&next, From::One(name), ops, len, false);
                    self.description.states[i].next = next;
                }
                _ => {
                    let mut ops = Vec::new();
                    let mut now = from.len;
                    for _ in 0..self.below(3) {
                        ops.push(self.op(&mut now));
                    }
                    ops.extend([self.reshaped(now, len), bound]);
                    self.end_value(&next, From::One(from.name), ops, len, false);
                    self.description.states[i].next = next;
                }
            }
        }
        // A state that takes another as its next value stays within what that one does.
        let names: Vec<String> = self.description.values.iter().map(|value| value.name.clone()).collect();
        for state in &mut self.description.states {
            if names.contains(&state.next) && !state.next.starts_with("next") {
                let bounded = format!("bounded_{}", state.name);
                let ops = vec![Op::Clip([-4.0, 4.0].map(Operand::Number))];
                let from = From::One(std::mem::replace(&mut state.next, bounded.clone()));
                self.description.values.push(Value { name: bounded, from, ops });
            }
        }
    }

    fn reshaped(&mut self, from: usize, to: usize) -> Op {
        Op::Select(Order::Places((0..to).map(|_| self.below(from)).collect()))
    }

    /// Adds up to `most` clocks, and perhaps a motion.
    fn times(&mut self, most: usize) {
        for _ in 0..self.below(most + 1) {
            self.clock();
        }
        if !self.is_one_in(3) {
            return;
        }
        let (name, rows, len) = (self.name("motion"), 1 + self.below(6), 1 + self.below(4));
        let values: Vec<f32> = (0..rows * len).map(|_| self.random.unit()).collect();
        let file = format!("{name}.npz");
        if let Ok(content) = super::npz("rows", &[rows, len], &values) {
            self.files.push((file.clone(), content));
        }
        let (lag, end) = (self.below(4), [End::Hold, End::Repeat][self.below(2)]);
        self.description.motions.push(Motion { name: name.clone(), file, array: "rows".to_owned(), lag, end });
        self.add(&name, len, true);
    }

    fn clock(&mut self) {
        let (name, legs) = (self.name("clock"), 1 + self.below(2));
        let when = [When::Before, When::After][self.below(2)];
        let mut clock = Clock { start: self.numbers(legs), ..Clock::from_zero(&name, 0.02, when) };
        let mut is_fed = true;
        match self.below(3) {
            // Slow, as 8 bits of a weight are few for phases that grow.
            0 => clock.advance = self.number() / 40.0,
            1 => {
                // Phases of n steps, half a step beside the limits, where rounding decides.
                let (n, low, span) = (3 + self.below(20), self.number(), 0.5 + self.number().abs());
                let step = span / n as f64;
                clock.start = (0..legs).map(|_| low + step * (0.5 + self.below(n) as f64)).collect();
                clock.advance = step * [1.0, 2.0, -1.0][self.below(3)];
                clock.wrap = Some([low, low + span]);
            }
            _ => {
                clock.advance = 0.05 + 0.1 * self.number().abs();
                clock.restart_above = Some(1.0);
            }
        }
        if self.is_one_in(2) && (clock.wrap.is_some() || clock.restart_above.is_some()) {
            let of: Vec<Drawn> = (0..1 + self.below(2)).map(|_| self.any()).collect();
            is_fed = of.iter().all(|value| value.is_fed && !value.name.contains('.'));
            let of = of.into_iter().map(|value| value.name).collect();
            clock.standing = Some(Standing { of, below: 0.2 + self.number().abs(), at: self.numbers(legs) });
        }
        self.description.clocks.push(clock);
        self.add(&name, legs, is_fed);
    }

    /// Draws a second operand: numbers, a constant, or a value.
    fn operand(&mut self, len: usize) -> Operand {
        let fitting: Vec<String> =
            self.values.iter().filter(|value| value.len == len || value.len == 1).map(|v| v.name.clone()).collect();
        match self.below(5) {
            0 => Operand::Number(self.number()),
            1 => Operand::List(self.numbers(len)),
            2 if len == 3 => Operand::Name("default".to_owned()),
            _ if fitting.is_empty() => Operand::Number(self.number()),
            _ => Operand::Name(fitting[self.below(fitting.len())].clone()),
        }
    }

    fn clip(&mut self, len: usize) -> Op {
        let (a, b) = (self.number(), self.number());
        Op::Clip(match self.below(4) {
            0 => [-a.abs() - 0.01, a.abs() + 0.01].map(Operand::Number),
            1 => [Operand::Number(a.min(b)), Operand::List((0..len).map(|_| a.max(b) + 0.1).collect())],
            2 => {
                let value = self.any_of(len);
                [Operand::Number(a), value]
            }
            _ => [self.any_of(len), self.any_of(len)],
        })
    }

    /// Returns a value of this length, or a number.
    fn any_of(&mut self, len: usize) -> Operand {
        let operand = self.operand(len);
        match operand {
            Operand::Name(ref name) if name != "default" => operand,
            _ => Operand::Name("command".to_owned()),
        }
    }

    /// Draws an operation on `len` numbers, and changes `len` to that of its result.
    fn op(&mut self, len: &mut usize) -> Op {
        match self.below(14) {
            0 => Op::Add(self.operand(*len)),
            1 => Op::Subtract(self.operand(*len)),
            2 | 3 => Op::Scale(self.operand(*len)),
            4 if self.is_one_in(30) => Op::Divide(Operand::Name("command".to_owned())),
            4 => Op::Divide(Operand::Number(self.number().abs() + 0.1)),
            5 | 6 => self.clip(*len),
            7 => Op::Wrap,
            8 => [Op::Sin, Op::Cos][self.below(2)].clone(),
            9 if *len == 3 => Op::Gravity(Orientation::Rpy),
            10 if *len > 1 => {
                *len = 1;
                Op::Norm
            }
            11 => {
                let to = 1 + self.below(5);
                let select = self.reshaped(*len, to);
                *len = to;
                select
            }
            12 => {
                let mut places: Vec<usize> = (0..*len).collect();
                for i in 1..*len {
                    places.swap(i, self.below(i + 1));
                }
                Op::Place(Order::Places(places))
            }
            13 if 4 * *len <= MOST => {
                let history = History {
                    length: 1 + self.below(4),
                    stride: 1 + self.below(3),
                    first: [First::Oldest, First::Newest][self.below(2)],
                    fill: [Fill::Zero, Fill::First][self.below(2)],
                    current: !self.is_one_in(3),
                };
                *len *= history.length;
                Op::History(history)
            }
            _ => Op::Scale(Operand::Number(self.number())),
        }
    }

    fn end_value(&mut self, name: &str, from: From, ops: Vec<Op>, len: usize, is_fed: bool) {
        self.description.values.push(Value { name: name.to_owned(), from, ops });
        self.add(name, len, is_fed);
    }

    /// Returns `true` if none of the values that operations read depends on a network.
    fn reads_no_network(&self, ops: &[Op]) -> bool {
        let is_free = |operand: &Operand| match operand {
            Operand::Name(name) => self.values.iter().all(|value| value.name != *name || self.is_free(value)),
            _ => true,
        };
        ops.iter().all(|op| match op {
            Op::Add(operand) | Op::Subtract(operand) | Op::Scale(operand) | Op::Divide(operand) => is_free(operand),
            Op::Clip(both) => both.iter().all(is_free),
            _ => true,
        })
    }

    fn is_free(&self, value: &Drawn) -> bool {
        value.is_fed && !value.name.contains('.')
    }

    /// Adds a value: several one after the other, or operations.
    fn value(&mut self) {
        let name = self.name("value");
        match self.below(8) {
            0 => {
                let orientation = [Orientation::Wxyz, Orientation::Xyzw][self.below(2)];
                return self.end_value(
                    &name,
                    From::One("quaternion".to_owned()),
                    vec![Op::Gravity(orientation)],
                    3,
                    true,
                );
            }
            1 => {
                let [policy, robot] = ["policy", "robot"].map(|order| Order::Joints(order.to_owned()));
                let ops = vec![Op::Select(policy), Op::Scale(self.operand(3)), Op::Place(robot)];
                let is_fed = self.reads_no_network(&ops);
                return self.end_value(&name, From::One("q".to_owned()), ops, 3, is_fed);
            }
            _ => {}
        }
        let from: Vec<Drawn> = (0..1 + self.below(3)).map(|_| self.any()).collect();
        let mut len = from.iter().map(|value| value.len).sum();
        if len > MOST {
            return;
        }
        let ops: Vec<Op> = (0..self.below(5)).map(|_| self.op(&mut len)).collect();
        let is_fed = match ops.is_empty() {
            true => from.iter().all(|value| self.is_free(value)),
            false => from.iter().all(|value| self.is_free(value)) && self.reads_no_network(&ops),
        };
        self.end_value(&name, From::Many(from.into_iter().map(|value| value.name).collect()), ops, len, is_fed);
    }

    /// Adds a network that reads values, and outputs of networks before it.
    fn network(&mut self) {
        let number = self.description.networks.len();
        let (name, file) = (format!("net{number}"), format!("net{number}.onnx"));
        let fed: Vec<Drawn> = self.values.iter().filter(|value| value.is_fed).cloned().collect();
        let (mut inputs, mut lens) = (BTreeMap::new(), Vec::new());
        for i in 0..1 + self.below(3) {
            let value = if self.is_one_in(60) { self.any() } else { fed[self.below(fed.len())].clone() };
            let input = format!("in{i}");
            lens.push((input.clone(), value.len));
            inputs.insert(input, value.name);
        }
        // A network often reads the one before, put together with others.
        let before = self.values.iter().rfind(|value| value.is_fed && value.name.contains('.')).cloned();
        if let Some(before) = before.filter(|_| number > 0 && self.random.below(3) > 0) {
            let (together, other) = (self.name("together"), fed[self.below(fed.len())].clone());
            let len = before.len + other.len;
            self.end_value(&together, From::Many(vec![before.name, other.name]), Vec::new(), len, false);
            lens.push(("together".to_owned(), len));
            inputs.insert("together".to_owned(), together);
        }
        let is_free = inputs.values().all(|name| self.values.iter().all(|v| v.name != *name || self.is_free(v)));
        let (content, outputs) = File::draw(&mut self.random, &lens);
        self.files.push((file.clone(), content));
        let states = outputs.state.into_iter().collect();
        self.description.networks.push(Network { name: name.clone(), file, inputs, states });
        for (output, len) in outputs.weighted {
            self.description.action = format!("{name}.{output}");
            self.add(&format!("{name}.{output}"), len, true);
        }
        for (output, len) in outputs.plain {
            // Without weights it is a value as others are.
            let alias = self.name("plain");
            self.end_value(&alias, From::One(format!("{name}.{output}")), Vec::new(), len, is_free);
        }
    }

    fn targets(&mut self) {
        let outputs: Vec<Drawn> = self.values.iter().filter(|value| value.name.contains('.')).cloned().collect();
        for i in 0..1 + self.below(3) {
            let kind = [TargetKind::Position, TargetKind::Velocity, TargetKind::Torque][self.below(3)];
            let mut value =
                if self.is_one_in(3) && i > 0 { self.any() } else { outputs[self.below(outputs.len())].clone() };
            if self.is_one_in(2) {
                let (name, scale) = (self.name("target"), Op::Scale(self.operand(value.len)));
                self.end_value(&name, From::One(value.name), vec![scale], value.len, false);
                value.name = name;
            }
            let [a, b] = [self.number(), self.number()];
            let limits = [Numbers::All(a.min(b)), Numbers::Each(vec![a.max(b) + 0.5; value.len])];
            let limits = Some(limits).filter(|_| self.random.below(2) == 0);
            if self.description.targets.iter().all(|target| target.value != value.name) {
                self.description.targets.push(Target { kind, value: value.name, joints: None, limits });
            }
        }
    }
}
