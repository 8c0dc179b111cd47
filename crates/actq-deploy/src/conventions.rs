//! Known conventions in which deploy code differs. One of them alone explains most differences from a reference.

use crate::description::{Description, Fill, First, From, History, Op, Operand, Order, Orientation, Value, When};

/// A description that differs from another in one convention.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The convention that differs.
    pub convention: String,
    /// The description.
    pub description: Description,
    /// It lacks an operation, so that none of its own variants is the original.
    pub lacks: bool,
}

/// Returns the variants of a description, each with one other convention.
pub fn variants(description: &Description) -> Vec<Variant> {
    let mut variants = Vec::new();
    histories(description, &mut variants);
    layouts(description, &mut variants);
    chains(description, &mut variants);
    states(description, &mut variants);
    for (i, clock) in description.clocks.iter().enumerate() {
        let mut other = description.clone();
        let (when, text) = match clock.when {
            When::Before => (When::After, "after"),
            When::After => (When::Before, "before"),
        };
        other.clocks[i].when = when;
        add(&mut variants, format!("clock {:?} advances {text} it is read", clock.name), other);
    }
    variants
}

fn add(variants: &mut Vec<Variant>, convention: String, description: Description) {
    variants.push(Variant { convention, description, lacks: false });
}

/// Changes all histories alike.
fn histories(description: &Description, variants: &mut Vec<Variant>) {
    let Some(first) = description.values.iter().flat_map(|value| &value.ops).find_map(history) else { return };
    let mut with = |convention: &str, change: fn(&mut History)| {
        let mut other = description.clone();
        for op in other.values.iter_mut().flat_map(|value| &mut value.ops) {
            if let Op::History(history) = op {
                change(history);
            }
        }
        add(variants, convention.to_owned(), other);
    };
    match first.first {
        First::Oldest => with("histories begin with the newest frame", |history| history.first = First::Newest),
        First::Newest => with("histories begin with the oldest frame", |history| history.first = First::Oldest),
    }
    match first.fill {
        Fill::Zero => with("histories are filled with the first frame", |history| history.fill = Fill::First),
        Fill::First => with("histories are filled with zeros", |history| history.fill = Fill::Zero),
    }
    match first.current {
        true => with("histories end with the tick before", |history| history.current = false),
        false => with("histories end with this tick", |history| history.current = true),
    }
}

fn history(op: &Op) -> Option<History> {
    if let Op::History(history) = op { Some(*history) } else { None }
}

/// Puts the frames of a term together instead of the terms of a frame, or the reverse.
fn layouts(description: &Description, variants: &mut Vec<Variant>) {
    for (i, value) in description.values.iter().enumerate() {
        let From::Many(terms) = &value.from else { continue };
        if let [Op::History(spec)] = value.ops[..] {
            let mut other = description.clone();
            other.values[i].ops.clear();
            let histories = terms.iter().enumerate().map(|(n, term)| Value {
                name: format!("{}_history_{n}", value.name),
                from: From::One(term.clone()),
                ops: vec![Op::History(spec)],
            });
            let histories: Vec<Value> = histories.collect();
            other.values[i].from = From::Many(histories.iter().map(|history| history.name.clone()).collect());
            other.values.extend(histories);
            add(variants, format!("{:?} is term-major: all frames of a term, then the next term", value.name), other);
        }
        let term = |name: &String| description.values.iter().position(|value| value.name == *name);
        let places: Vec<usize> = terms.iter().filter_map(term).collect();
        let specs: Vec<History> =
            places.iter().filter_map(|&term| description.values[term].ops.last().and_then(history)).collect();
        if value.ops.is_empty() && specs.len() == terms.len() && specs.windows(2).all(|pair| pair[0] == pair[1]) {
            let mut other = description.clone();
            for &place in &places {
                other.values[place].ops.pop();
            }
            other.values[i].ops.push(Op::History(specs[0]));
            add(variants, format!("{:?} is frame-major: all terms of a frame, then the next frame", value.name), other);
        }
    }
}

/// Changes the operations of chains.
fn chains(description: &Description, variants: &mut Vec<Variant>) {
    for (i, value) in description.values.iter().enumerate() {
        for (k, op) in value.ops.iter().enumerate() {
            let mut with = |convention: String, ops: Vec<Op>| {
                let mut other = description.clone();
                let lacks = ops.len() < value.ops.len();
                other.values[i].ops = ops;
                variants.push(Variant { convention, description: other, lacks });
            };
            let name = &value.name;
            let replaced = |op: Op| {
                let mut ops = value.ops.clone();
                ops[k] = op;
                ops
            };
            let removed = || {
                let mut ops = value.ops.clone();
                ops.remove(k);
                ops
            };
            match op {
                Op::Select(Order::Places(places)) => {
                    with(
                        format!("the permutation of {name:?} is the reverse"),
                        replaced(Op::Place(Order::Places(places.clone()))),
                    );
                    with(format!("{name:?} is not permuted"), removed());
                }
                Op::Place(Order::Places(places)) => {
                    with(
                        format!("the permutation of {name:?} is the reverse"),
                        replaced(Op::Select(Order::Places(places.clone()))),
                    );
                    with(format!("{name:?} is not permuted"), removed());
                }
                Op::Gravity(orientation) => {
                    let (other, text) = match orientation {
                        Orientation::Wxyz => (Orientation::Xyzw, "last"),
                        Orientation::Xyzw => (Orientation::Wxyz, "first"),
                        Orientation::Rpy => continue,
                    };
                    with(format!("the quaternion of {name:?} has its real part {text}"), replaced(Op::Gravity(other)));
                }
                Op::Subtract(Operand::Name(default)) if !description.is_all(&Operand::Name(default.clone()), 0.0) => {
                    with(format!("{name:?} is not relative to {default:?}"), removed());
                }
                Op::Scale(by) if !description.is_all(by, 1.0) => with(format!("{name:?} is not scaled"), removed()),
                Op::Clip(_) => with(format!("{name:?} is not clipped"), removed()),
                _ => {}
            }
            let next = value.ops.get(k + 1);
            let swaps = match (op, next) {
                (Op::Scale(by), Some(Op::Clip(_))) | (Op::Clip(_), Some(Op::Scale(by))) => !description.is_all(by, 1.0),
                _ => false,
            };
            if swaps {
                let mut ops = value.ops.clone();
                ops.swap(k, k + 1);
                let order = if matches!(op, Op::Scale(_)) { "before" } else { "after" };
                with(format!("{name:?} is clipped {order} it is scaled"), ops);
            }
        }
    }
}

/// Feeds back another stage between the action and the target.
fn states(description: &Description, variants: &mut Vec<Variant>) {
    // Values that one source leads to from the action, in the order of their making.
    let mut stages = vec![description.action.as_str()];
    for value in &description.values {
        if matches!(&value.from, From::One(from) if stages.contains(&from.as_str())) {
            stages.push(&value.name);
        }
    }
    for (i, state) in description.states.iter().enumerate() {
        if !stages.contains(&state.next.as_str()) {
            continue;
        }
        for stage in stages.iter().filter(|stage| **stage != state.next) {
            let mut other = description.clone();
            other.states[i].next = (*stage).to_owned();
            add(variants, format!("{:?} keeps {stage:?}", state.name), other);
        }
    }
}

impl Description {
    /// Returns `true` if all numbers of an operand are `number`.
    fn is_all(&self, operand: &Operand, number: f64) -> bool {
        match operand {
            Operand::Number(own) => *own == number,
            Operand::List(list) => list.iter().all(|own| *own == number),
            Operand::Name(name) => self.constants.get(name).is_some_and(|list| list.iter().all(|own| *own == number)),
        }
    }
}
