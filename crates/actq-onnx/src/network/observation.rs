//! The inputs that the action depends on: its observation and its recurrent states.

use std::collections::HashMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::options::ImportOptions;
use crate::file::model::Model;
use crate::nodes::follow::INTEGERS;
use crate::states::{Chosen, Output, Pairs};
use crate::values::expr::{Expr, Exprs, Id};

/// The observed inputs, one after the other.
pub(super) struct Observation {
    pub(super) inputs: Vec<(String, usize)>,
    /// Names of those that the file takes as integers.
    pub(super) integers: Vec<String>,
    /// First value of each in the observation, by the input's index in the graph.
    pub(super) offsets: HashMap<usize, usize>,
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

    /// Takes the time and the iterate, which are last, from the observation. Returns the slots of all three.
    pub(super) fn of_denoiser(&mut self) -> Result<Vec<(&'static str, usize)>> {
        let [.., (_, time), (_, iterate)] = self.inputs[..] else { bail!("a denoiser reads a time and an iterate") };
        self.inputs.truncate(self.inputs.len() - 2);
        self.integers.retain(|name| self.inputs.iter().any(|(input, _)| input == name));
        self.len -= time + iterate;
        ensure!(self.len > 0, "the network reads the time and the iterate alone, and no observation");
        Ok(vec![("obs", self.len), ("tfeat", time), ("x", iterate)])
    }
}

/// Returns the indices of the inputs among these expressions.
pub(super) fn read_inputs(exprs: &Exprs, live: &[Id]) -> Vec<usize> {
    let input = |&id: &Id| if let Expr::Input(i) = exprs.get(id) { Some(*i) } else { None };
    let mut read: Vec<usize> = live.iter().filter_map(input).collect();
    read.sort_unstable();
    read
}

/// Returns the indices of the inputs with these names. Refuses one that the action does not `read`.
pub(super) fn prefix_inputs(model: &Model, read: &[usize], names: &[String]) -> Result<Vec<usize>> {
    let index = |name: &String| {
        let found = read.iter().find(|i| model.graph.inputs[**i].name == *name).copied();
        found.with_context(|| format!("--prefix {}: the action does not depend on this input", printable(name)))
    };
    names.iter().map(index).collect()
}

/// Returns the inputs that the action `read`s, by their indices, except states. Refuses an action without any.
pub(super) fn observed_inputs(
    graph: &Chosen<'_>,
    mut read: Vec<usize>,
    pairs: &Pairs,
    options: &ImportOptions,
) -> Result<Vec<usize>> {
    if !options.is_fed {
        graph.refuse_lost_states(&read, pairs, &options.states, &options.observed)?;
    }
    read.retain(|i| !pairs.iter().any(|(state, _)| state == i));
    let action = printable(graph.action);
    ensure!(!read.is_empty(), "output {action:?} depends on no input; choose another by --output NAME");
    if !options.is_fed {
        refuse_constants(graph.model, &read, &options.observed)?;
    }
    Ok(read)
}

/// Refuses inputs beside the observation that look like constants of the network, as exporters make them of a
/// normalizer's mean and variance, unless they are among the `observed`.
fn refuse_constants(model: &Model, read: &[usize], observed: &[String]) -> Result<()> {
    let shape = |i: usize| model.graph.inputs[i].shape.as_deref().unwrap_or_default();
    let len = |i: usize| shape(i).iter().map(|axis| axis.unwrap_or(1)).product::<usize>();
    let is_dynamic = |i: usize| shape(i).contains(&None);
    for &i in read.iter().filter(|i| !observed.contains(&model.graph.inputs[**i].name)) {
        let name = &model.graph.inputs[i].name;
        let batch = read.iter().find(|&&other| is_dynamic(other) && !is_dynamic(i) && len(other) == len(i));
        let fact = match batch {
            Some(&other) => {
                format!(
                    "has no dynamic axis, unlike {:?} of the same length",
                    printable(&model.graph.inputs[other].name)
                )
            }
            None if read.len() > 1 && is_constant(name) => "has the name of a constant of the network".to_owned(),
            None => continue,
        };
        let name = printable(name);
        bail!(
            "the input {name:?} {fact}: exporters make the mean and the variance of a normalizer such inputs; export it as an \
             initializer with its values, or, if it is measured anew in each step, pass --observe {name}"
        );
    }
    Ok(())
}

/// Returns `true` if a name is that of a constant of a network, as `mean` or `model/normalization_1/Sub/y:0`.
fn is_constant(name: &str) -> bool {
    const LAST: [&str; 11] =
        ["mean", "variance", "var", "std", "stddev", "kernel", "weight", "weights", "bias", "gamma", "beta"];
    const ANY: [&str; 3] = ["normalization", "batchnorm", "layernorm"];
    let name = name.to_lowercase();
    let mut parts = name.rsplit(|c: char| !c.is_ascii_alphabetic()).filter(|part| !part.is_empty());
    parts.next().is_some_and(|part| LAST.contains(&part)) || parts.any(|part| ANY.contains(&part))
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
