//! A description in words, for tables.

use actq::text::count;

use crate::description::{Description, End, Fill, First, From, History, Op, Operand, Order, Orientation, When};

/// A part of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Its section.
    pub section: &'static str,
    /// Its name.
    pub name: String,
    /// Its inputs and operations.
    pub content: String,
}

/// Most numbers of a list that are shown.
const MAX_NUMBERS: usize = 3;

impl Description {
    /// Returns its parts in the order of the file.
    pub fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        let mut add = |section, name: &str, content: String| rows.push(Row { section, name: name.to_owned(), content });
        for input in &self.inputs {
            let len = input.len.or_else(|| Some(self.joints.get(input.joints.as_ref()?)?.len())).unwrap_or(0);
            let unit = input.unit.as_ref().map_or(String::new(), |unit| format!(", {unit}"));
            let joints =
                input.joints.as_ref().map_or(String::new(), |order| format!(" in the order of joints.{order}"));
            add("input", &input.name, format!("{}{joints}{unit}", count(len, "value")));
        }
        for state in &self.states {
            add("state", &state.name, format!("{}; next tick: {}", count(state.len, "value"), state.next));
        }
        for clock in &self.clocks {
            let when = if clock.when == When::Before { "before" } else { "after" };
            let standing = if clock.standing.is_some() { ", with a phase for standing" } else { "" };
            add("clock", &clock.name, format!("{:.6} a tick, {when} it is read{standing}", clock.advance));
        }
        for motion in &self.motions {
            let end = if motion.end == End::Repeat { "repeats" } else { "holds its last row" };
            add(
                "motion",
                &motion.name,
                format!("{}: {}, {} late, {end}", motion.file, motion.array, count(motion.lag, "tick")),
            );
        }
        for value in &self.values {
            let from = match &value.from {
                From::One(name) => name.clone(),
                From::Many(names) => format!("[{}]", names.join(", ")),
            };
            let ops = value.ops.iter().map(|op| format!(", {}", op_text(op))).collect::<String>();
            add("value", &value.name, from + &ops);
        }
        for network in &self.networks {
            let inputs = network.inputs.iter().map(|(input, value)| format!("{input} = {value}"));
            let states = network.states.iter().map(|(input, output)| format!("{input} = {output} of the tick before"));
            let all: Vec<String> = inputs.chain(states).collect();
            add("network", &network.name, format!("{}: {}", network.file, all.join(", ")));
        }
        for target in &self.targets {
            let joints =
                target.joints.as_ref().map_or(String::new(), |order| format!(" in the order of joints.{order}"));
            let limits = target.limits.as_ref().map_or(String::new(), |limits| {
                let [low, high] = limits.each_ref().map(|numbers| operand_text(&numbers.operand()));
                format!(", limits {low} to {high}")
            });
            add("target", &target.value, format!("{:?}{joints}{limits}", target.kind).to_lowercase());
        }
        rows
    }
}

fn op_text(op: &Op) -> String {
    match op {
        Op::Select(order) => format!("select {}", order_text(order)),
        Op::Place(order) => format!("place {}", order_text(order)),
        Op::Add(by) => format!("+ {}", operand_text(by)),
        Op::Subtract(by) => format!("- {}", operand_text(by)),
        Op::Scale(by) => format!("* {}", operand_text(by)),
        Op::Divide(by) => format!("/ {}", operand_text(by)),
        Op::Clip([low, high]) => format!("clip {} to {}", operand_text(low), operand_text(high)),
        Op::Wrap => "wrap".to_owned(),
        Op::Gravity(orientation) => {
            let of = match orientation {
                Orientation::Wxyz => "quaternion w x y z",
                Orientation::Xyzw => "quaternion x y z w",
                Orientation::Rpy => "roll pitch yaw",
            };
            format!("gravity of {of}")
        }
        Op::Sin => "sin".to_owned(),
        Op::Cos => "cos".to_owned(),
        Op::Norm => "norm".to_owned(),
        Op::History(history) => history_text(history),
    }
}

fn history_text(history: &History) -> String {
    let first = if history.first == First::Oldest { "oldest" } else { "newest" };
    let fill = if history.fill == Fill::First { "the first frame" } else { "zeros" };
    let stride = if history.stride > 1 { format!(" every {} ticks", history.stride) } else { String::new() };
    let current = if history.current { "" } else { " before this tick" };
    format!("{}{stride}{current}, {first} first, filled with {fill}", count(history.length, "frame"))
}

fn order_text(order: &Order) -> String {
    match order {
        Order::Joints(order) => format!("joints.{order}"),
        Order::Places(places) => numbers_text(&places.iter().map(ToString::to_string).collect::<Vec<_>>()),
    }
}

fn operand_text(operand: &Operand) -> String {
    match operand {
        Operand::Number(number) => number.to_string(),
        Operand::List(list) if list.windows(2).all(|pair| pair[0] == pair[1]) && !list.is_empty() => {
            list[0].to_string()
        }
        Operand::List(list) => numbers_text(&list.iter().map(ToString::to_string).collect::<Vec<_>>()),
        Operand::Name(name) => name.clone(),
    }
}

fn numbers_text(numbers: &[String]) -> String {
    let shown = numbers[..numbers.len().min(MAX_NUMBERS)].join(", ");
    if numbers.len() > MAX_NUMBERS { format!("[{shown} .. {} values]", numbers.len()) } else { format!("[{shown}]") }
}
