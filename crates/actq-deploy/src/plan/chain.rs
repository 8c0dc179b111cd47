//! The operations of a chain, checked and with their numbers.

use actq::error::{Context as _, Result, bail, ensure};

use super::builder::{Builder, MOST};
use super::numbers::finite;
use super::parts::{Arg, PlannedOp, ValueIndex, ValueSource};
use crate::description::{Op, Operand, Order, Orientation, Value};
use crate::label::Label;

/// A value while its chain is followed.
struct Chain {
    labels: Vec<Label>,
    joints: Option<String>,
}

impl Builder<'_> {
    /// Makes a value, after those that its operations read.
    pub(super) fn chain(&mut self, value: &Value) -> Result<ValueIndex> {
        let own = format!("value {:?}", value.name);
        let names = value.from.names();
        ensure!(!names.is_empty(), "{own}: from is empty");
        let from = names.iter().map(|name| self.value(name, &format!("{own}: from"))).collect::<Result<Vec<_>>>()?;
        let len: usize = from.iter().map(|index| self.plan.values[*index].labels.len()).sum();
        ensure!(len <= MOST, "{own}: from has {len} values; at most {MOST} are allowed");
        let mut labels: Vec<Label> = from.iter().flat_map(|index| self.plan.values[*index].labels.clone()).collect();
        let mut joints = None;
        if let [only] = from[..] {
            joints.clone_from(&self.plan.values[only].joints);
            labels.iter_mut().for_each(|label| label.value.clone_from(&value.name));
        }
        let mut chain = Chain { labels, joints };
        let mut steps = Vec::new();
        for (i, op) in value.ops.iter().enumerate() {
            let key = format!("{own}: do[{i}]");
            steps.push(self.op(op, &mut chain, &value.name, &key)?);
            let len = chain.labels.len();
            ensure!(0 < len && len <= MOST, "{key}: it gives {len} values; 1 to {MOST} are allowed");
        }
        self.add(&value.name, ValueSource::Value(from, steps), chain.labels, chain.joints)
    }

    fn op(&mut self, op: &Op, chain: &mut Chain, name: &str, key: &str) -> Result<PlannedOp> {
        let len = chain.labels.len();
        let fresh = |len| crate::label::labels(name, len, None);
        Ok(match op {
            Op::Select(order) => {
                let places = self.places(order, chain.joints.as_deref(), len, key)?;
                chain.labels = places.iter().map(|place| chain.labels[*place].clone()).collect();
                chain.joints = if let Order::Joints(order) = order { Some(order.clone()) } else { None };
                Op::Select(places)
            }
            Op::Place(order) => {
                let places = match order {
                    Order::Places(places) => places.clone(),
                    Order::Joints(to) => {
                        let of = chain.joints.as_ref().with_context(|| {
                            format!("{key}: its values are in no order of joints; give places, or select joints first")
                        })?;
                        let (from, to_len) = (Order::Joints(of.clone()), self.joints(to, key)?.len());
                        self.places(&from, Some(to), to_len, key)?
                    }
                };
                let mut labels: Vec<Option<Label>> = vec![None; len];
                ensure!(places.len() == len, "{key}: it has {} places for {len} values", places.len());
                for (label, place) in chain.labels.iter().zip(&places) {
                    let free = labels.get_mut(*place).filter(|taken| taken.is_none());
                    *free.with_context(|| format!("{key}: the places are not a permutation of 0 to {}", len - 1))? =
                        Some(label.clone());
                }
                chain.labels = labels.into_iter().flatten().collect();
                chain.joints = if let Order::Joints(order) = order { Some(order.clone()) } else { None };
                Op::Place(places)
            }
            Op::Add(operand) => Op::Add(self.operand(operand, len, key)?),
            Op::Subtract(operand) => Op::Subtract(self.operand(operand, len, key)?),
            Op::Scale(operand) => Op::Scale(self.operand(operand, len, key)?),
            Op::Divide(operand) => {
                let arg = self.operand(operand, len, key)?;
                if let Arg::Numbers(numbers) = &arg {
                    ensure!(!numbers.contains(&0.0), "{key}: it divides by 0");
                }
                Op::Divide(arg)
            }
            Op::Clip([low, high]) => {
                let both = [self.operand(low, len, key)?, self.operand(high, len, key)?];
                if let [Arg::Numbers(low), Arg::Numbers(high)] = &both {
                    let at = |list: &[f64], i: usize| list[if list.len() == 1 { 0 } else { i }];
                    if let Some(i) = (0..len).find(|&i| at(low, i) > at(high, i)) {
                        bail!("{key}: clip = [{}, {}]; give the lowest number first", at(low, i), at(high, i));
                    }
                }
                Op::Clip(both)
            }
            Op::Wrap => Op::Wrap,
            Op::Sin => Op::Sin,
            Op::Cos => Op::Cos,
            Op::Norm => {
                *chain = Chain { labels: fresh(1), joints: None };
                Op::Norm
            }
            Op::Gravity(orientation) => {
                let needed = if *orientation == Orientation::Rpy { 3 } else { 4 };
                ensure!(len == needed, "{key}: an orientation has {needed} values; this value has {len}");
                *chain = Chain { labels: fresh(3), joints: None };
                Op::Gravity(*orientation)
            }
            Op::History(history) => {
                ensure!(history.length > 0 && history.stride > 0, "{key}: length and stride must be at least 1");
                let all = history.length.checked_mul(history.stride).and_then(|n| n.checked_mul(len));
                ensure!(all.is_some_and(|all| all <= MOST), "{key}: it keeps more than {MOST} values");
                let ages = crate::history::ages(history);
                let aged = |age: &usize| chain.labels.iter().map(|label| label.older(*age)).collect::<Vec<_>>();
                *chain = Chain { labels: ages.iter().flat_map(aged).collect(), joints: None };
                Op::History(*history)
            }
        })
    }

    fn operand(&mut self, operand: &Operand, len: usize, key: &str) -> Result<Arg> {
        let numbers = match operand {
            Operand::Number(number) => vec![*number],
            Operand::List(list) => list.clone(),
            Operand::Name(name) => match self.description.constants.get(name) {
                Some(list) => list.clone(),
                None => {
                    let index = self.value(name, key)?;
                    let given = self.plan.values[index].labels.len();
                    ensure!(given == len || given == 1, "{key}: {name:?} has {given} values, and the value {len}");
                    return Ok(Arg::Value(index));
                }
            },
        };
        finite(&numbers).context(key.to_owned())?;
        ensure!(
            numbers.len() == len || numbers.len() == 1,
            "{key}: it has {} numbers, and the value {len}",
            numbers.len()
        );
        Ok(Arg::Numbers(numbers))
    }
}
