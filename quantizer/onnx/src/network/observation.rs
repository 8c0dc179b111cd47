//! The inputs that the action depends on: its observation and its recurrent states.

use std::collections::HashMap;

use actq::error::{Result, bail, ensure};
use actq::text::printable;

use super::choice::Choice;
use crate::file::model::Model;
use crate::nodes::follow::INTEGERS;
use crate::states::{Output, Pairs, refuse_lost_states};
use crate::values::expr::{Expr, Exprs, Id};

/// The observed inputs, one after the other.
pub(super) struct Observation {
    /// Names and lengths.
    pub(super) inputs: Vec<(String, usize)>,
    /// Names of those that the file takes as integers.
    pub(super) integers: Vec<String>,
    /// First value of each in the observation, by the input's index in the graph.
    pub(super) offsets: HashMap<usize, usize>,
    /// Number of values.
    pub(super) len: usize,
}

impl Observation {
    /// Concatenates inputs, by their indices in the graph. `live` are the expressions that the action depends on.
    pub(super) fn of(model: &Model, exprs: &Exprs, live: &[Id], observed: &[usize]) -> Self {
        let mut observation = Self { inputs: Vec::new(), integers: Vec::new(), offsets: HashMap::new(), len: 0 };
        for &i in observed {
            let input = live.iter().find(|&&id| *exprs.get(id) == Expr::Input(i));
            let len = input.map_or(0, |&id| exprs.len_of(id));
            let port = &model.graph.inputs[i];
            let name = printable(&port.name).into_owned();
            observation.offsets.insert(i, observation.len);
            observation.len += len;
            observation.integers.extend(INTEGERS.contains(&port.kind).then(|| name.clone()));
            observation.inputs.push((name, len));
        }
        observation
    }
}

/// Returns the indices of the inputs that the action depends on, except states. Refuses an action without any.
pub(super) fn observed_inputs(
    model: &Model,
    exprs: &Exprs,
    live: &[Id],
    (pairs, outputs): (&Pairs, &[Output]),
    action: &str,
    choice: &Choice,
) -> Result<Vec<usize>> {
    let mut read: Vec<usize> =
        live.iter().filter_map(|&id| if let Expr::Input(i) = exprs.get(id) { Some(*i) } else { None }).collect();
    read.sort_unstable();
    if !choice.is_fed {
        refuse_lost_states(model, &read, pairs, outputs, action, &choice.states)?;
    }
    read.retain(|i| !pairs.iter().any(|(state, _)| state == i));
    ensure!(!read.is_empty(), "output {:?} depends on no input; choose another by --output NAME", printable(action));
    Ok(read)
}

/// Names the inputs that hold states and the outputs of their next values, with their lengths.
pub(super) fn named_states(model: &Model, pairs: &Pairs, outputs: &[Output]) -> Vec<(String, String, usize)> {
    let shown = |name: &str| printable(name).into_owned();
    let named = |&(input, output): &(usize, usize)| {
        let (from, to) = (&model.graph.inputs[input], &outputs[output]);
        (shown(&from.name), shown(&to.name), to.value.len())
    };
    pairs.iter().map(named).collect()
}

/// Refuses an action that is computed with the integers of an input.
pub(super) fn refuse_integers(model: &Model, exprs: &Exprs, live: &[Id]) -> Result<()> {
    let integers = |&id: &Id| if let Expr::Integers(i) = exprs.get(id) { Some(*i) } else { None };
    if let Some(i) = live.iter().find_map(integers) {
        bail!(
            "the action is computed with the integers of the input {:?}, and an observation is float32; cast the input to float32 \
             first",
            printable(&model.graph.inputs[i].name)
        );
    }
    Ok(())
}
