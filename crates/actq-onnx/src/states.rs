//! Pairs of inputs that hold recurrent state and outputs of its next value.

use std::collections::HashMap;

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::text::printable;

use crate::caches::Caches;
use crate::file::model::Model;
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Run};
use crate::values::tensor::{Element, Tensor};

/// An output of the graph, with its value.
pub(crate) struct Output {
    pub(crate) name: String,
    pub(crate) value: Tensor,
}

/// Indices of state inputs and of the outputs of their next values.
pub(crate) type Pairs = Vec<(usize, usize)>;

/// Cells that an exporter decomposed.
#[derive(Default)]
pub(crate) struct Cells {
    /// States after the step in the file, with the expressions of the cells that replace them.
    pub(crate) instead: HashMap<Id, Id>,
    /// Attentions to the tokens of earlier steps.
    pub(crate) caches: Caches,
}

impl Cells {
    /// Finds the cells whose next states are among the outputs. `named` are pairs of inputs and outputs from the
    /// caller.
    ///
    /// # Errors
    ///
    /// If two inputs may be the state of an LSTM.
    pub(crate) fn find(
        model: &Model,
        exprs: &mut Exprs,
        outputs: &[Output],
        named: &[(String, String)],
    ) -> Result<Self> {
        let caches = Caches::find(exprs, outputs);
        let mut found = Self { instead: caches.instead.clone(), caches };
        for output in outputs {
            let elements = output.value.elements();
            let mut at = 0;
            while at < elements.len() {
                let Element::Of(next, 0) = elements[at] else {
                    at += 1;
                    continue;
                };
                let len = exprs.len_of(next);
                let whole = (0..len).all(|k| elements.get(at + k) == Some(&Element::Of(next, k)));
                if whole && !matches!(exprs.get(next), Expr::Cell(_) | Expr::CellState(_) | Expr::Input(_)) {
                    let candidates = candidates(model, exprs, output, Run { of: 0, from: at, len }, named);
                    let cell = match exprs.gru_of(next) {
                        Some(cell) => Some(cell),
                        None => match exprs.lstm_of(next, &candidates) {
                            Ok(cell) => cell,
                            Err(runs) => return Err(ambiguous(model, exprs, output, runs)),
                        },
                    };
                    if let Some(cell) = cell {
                        let h = exprs.put(Expr::Cell(Box::new(cell.cell)), len);
                        found.instead.insert(next, h);
                        if let Some(next_c) = cell.next_c {
                            let c = exprs.put(Expr::CellState(h), len);
                            found.instead.insert(next_c, c);
                        }
                    }
                }
                at += if whole { len } else { 1 };
            }
        }
        Ok(found)
    }

    /// Replaces an element of a decomposed cell by that of the cell.
    fn element(&self, element: Element) -> Element {
        match element {
            Element::Of(id, i) => Element::Of(self.instead.get(&id).copied().unwrap_or(id), i),
            known => known,
        }
    }

    /// Returns the elements of a value, with decomposed cells replaced.
    pub(crate) fn elements(&self, value: &Tensor) -> Vec<Element> {
        value.elements().into_iter().map(|element| self.element(element)).collect()
    }

    /// Finds the outputs that carry the states of all cells in use. Refuses a state without such an output.
    pub(crate) fn pairs(&self, model: &Model, exprs: &Exprs, live: &[Id], outputs: &[Output]) -> Result<Pairs> {
        let mut pairs = Pairs::new();
        let cell = |id: Id| if let Expr::Cell(cell) = exprs.get(id) { Some((id, cell)) } else { None };
        for (h, cell) in live.iter().filter_map(|&id| cell(id)) {
            for (i, run) in cell.states.iter().enumerate() {
                let (input, name) = input_of(model, exprs, run)?;
                let is_next = |element: &Element, k: usize| match *element {
                    Element::Of(id, at) if i == 0 => id == h && at == k,
                    Element::Of(id, at) => *exprs.get(id) == Expr::CellState(h) && at == k,
                    Element::Known(_) => false,
                };
                let carries = |output: &Output| {
                    let elements = self.elements(&output.value);
                    let part = elements.get(run.from..run.from + run.len);
                    elements.len() == exprs.len_of(run.of)
                        && part.is_some_and(|part| part.iter().enumerate().all(|(k, e)| is_next(e, k)))
                };
                let output = outputs.iter().position(carries).with_context(|| {
                    format!("state {name:?} is not carried to the next step; export its next value as an output, in the same order")
                })?;
                let known = pairs.iter().find(|(other, _)| *other == input);
                ensure!(
                    known.is_none_or(|(_, other)| *other == output),
                    "two outputs carry the state {name:?}; pass the exporter a separate tensor for each state"
                );
                if known.is_none() {
                    pairs.push((input, output));
                }
            }
        }
        for &pair in live.iter().filter_map(|id| self.caches.pairs.get(id)).flatten() {
            if !pairs.contains(&pair) {
                pairs.push(pair);
            }
        }
        Ok(pairs)
    }
}

fn input_of(model: &Model, exprs: &Exprs, run: &Run) -> Result<(usize, String)> {
    let &Expr::Input(i) = exprs.get(run.of) else { bail!("a state is not an input of the graph") };
    let port = model.graph.inputs.get(i).context("a state is not an input of the graph")?;
    Ok((i, printable(&port.name).into_owned()))
}

/// Says that two inputs may be the state of an LSTM.
fn ambiguous(model: &Model, exprs: &Exprs, output: &Output, runs: [Run; 2]) -> Error {
    let [first, second] = runs.map(|run| input_of(model, exprs, &run).map(|(_, name)| name).unwrap_or_default());
    let next = printable(&output.name);
    Error::input(format!(
        "the inputs {first:?} and {second:?} have the same length, and either may be the state whose next value is the output \
         {next:?}; pass --state {first}={next} or --state {second}={next}"
    ))
}

/// Lists runs of inputs that may be the hidden state whose next value is at `place` of an output: inputs as long as the
/// output. Those that the caller pairs have rank 0 and come first, then those with a similar name.
fn candidates(
    model: &Model,
    exprs: &mut Exprs,
    output: &Output,
    place: Run,
    named: &[(String, String)],
) -> Vec<(usize, Run)> {
    let mut found: Vec<(usize, Run)> = Vec::new();
    for (i, port) in model.graph.inputs.iter().enumerate() {
        if port.len() != Some(output.value.len()) {
            continue;
        }
        let of = exprs.put(Expr::Input(i), output.value.len());
        let rank = if named.iter().any(|(from, to)| *from == port.name && *to == output.name) {
            0
        } else if stem(&port.name) == stem(&output.name) {
            1
        } else {
            2
        };
        found.push((rank, Run { of, ..place }));
    }
    found.sort_by_key(|(rank, _)| *rank);
    found
}

/// Strips the parts of a name that distinguish a state before a step from the state after it.
fn stem(name: &str) -> String {
    const SIDES: [&str; 16] = [
        "in", "out", "input", "output", "inputs", "outputs", "prev", "next", "new", "old", "last", "state", "states",
        "0", "n", "t",
    ];
    let lower = name.to_lowercase();
    let parts =
        lower.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty() && !SIDES.contains(part));
    let joined = parts.collect::<Vec<_>>().join("_");
    // h0 and hn, hin and hout
    for end in ["in", "out", "n", "0"] {
        if let Some(short) = joined.strip_suffix(end).filter(|short| matches!(*short, "h" | "c")) {
            return short.to_owned();
        }
    }
    joined
}

/// A graph with its cells, whose action is chosen.
pub(crate) struct Chosen<'a> {
    pub(crate) model: &'a Model,
    pub(crate) exprs: &'a Exprs,
    pub(crate) cells: &'a Cells,
    pub(crate) outputs: &'a [Output],
    pub(crate) action: &'a str,
}

impl Chosen<'_> {
    /// Refuses inputs that look like a state but belong to no cell, and are not among the `observed`: the policy would
    /// read them as observations. `live` are the inputs that the action reads, `named` the pairs of the caller.
    pub(crate) fn refuse_lost_states(
        &self,
        live: &[usize],
        pairs: &Pairs,
        named: &[(String, String)],
        observed: &[String],
    ) -> Result<()> {
        let help = "only states of LSTM and GRU cells (in torch's forms) and tokens of attention are carried from step to step; make \
                    any other memory an observation, an input without an output";
        for (from, to) in named {
            let is_pair =
                |(i, o): &(usize, usize)| self.model.graph.inputs[*i].name == *from && self.outputs[*o].name == *to;
            ensure!(
                pairs.iter().any(is_pair),
                "--state {}={}: no cell between them leads to the action; {help}",
                printable(from),
                printable(to)
            );
        }
        for name in observed {
            let at = live.iter().find(|i| self.model.graph.inputs[**i].name == *name);
            let at = at.with_context(|| format!("--observe {}: the action does not depend on it", printable(name)))?;
            ensure!(
                !pairs.iter().any(|(state, _)| state == at),
                "--observe {}: an LSTM or GRU cell reads it as its state, which the policy keeps",
                printable(name)
            );
        }
        let is_open = |i: &&usize| {
            let name = &self.model.graph.inputs[**i].name;
            !pairs.iter().any(|(state, _)| state == *i) && !observed.contains(name)
        };
        for &i in live.iter().filter(is_open) {
            let port = &self.model.graph.inputs[i];
            let name = printable(&port.name);
            if let Some(reason) = self.cells.caches.reasons.get(&i) {
                bail!(
                    "the input {name:?} holds tokens of earlier steps, and {reason}; if it is measured anew in each step, pass --observe \
                     {name}; keys and values from a host are a prefix (docs/IMPORT.md)"
                );
            }
            ensure!(
                !self.is_read_by_cells(i),
                "the action reads the input {name:?} before the cell that has it as its state; only the value after the step has an \
                 operation"
            );
            let len: usize = port.shape.iter().flatten().map(|n| n.unwrap_or(1)).product();
            let next = self.outputs.iter().find(|output| {
                output.name != self.action
                    && output.value.len() == len
                    && are_sides(&port.name, &output.name)
                    && !self.is_observation(i, live, output)
            });
            if let Some(output) = next {
                bail!(
                    "the input {name:?} and the output {:?} look like a recurrent state, but no LSTM or GRU cell is between them; if it \
                     is measured anew in each step, pass --observe {name}; {help}",
                    printable(&output.name)
                );
            }
        }
        Ok(())
    }

    /// Returns `true` if a cell of any output has this input as its state.
    fn is_read_by_cells(&self, input: usize) -> bool {
        let is_input = |run: &Run| *self.exprs.get(run.of) == Expr::Input(input);
        self.needed(self.outputs).iter().any(|&id| match self.exprs.get(id) {
            Expr::Cell(cell) => cell.states.iter().any(is_input),
            _ => false,
        })
    }

    /// Returns `true` if an input is no state, although an output may be its next value: it has an observation's name,
    /// or the graph only passes it on, or the policy would observe nothing in any step.
    fn is_observation(&self, input: usize, live: &[usize], next: &Output) -> bool {
        let name = &self.model.graph.inputs[input].name;
        if parts(name).any(|part| MEMORY.contains(&part.as_str())) {
            return false;
        }
        let is_passed = |(k, element): (usize, &Element)| {
            value(element).is_some_and(|(id, i)| i == k && *self.exprs.get(id) == Expr::Input(input))
        };
        let reads = self.needed(std::slice::from_ref(next));
        let is_other = |&id: &Id| matches!(self.exprs.get(id), Expr::Input(i) | Expr::Integers(i) if *i != input);
        let last = stem(name).rsplit('_').next().map(str::to_owned);
        last.is_some_and(|last| ["obs", "observation", "observations"].contains(&last.as_str()))
            || next.value.elements().iter().enumerate().all(is_passed)
            || live == [input] && !reads.iter().any(is_other)
    }

    /// Lists the expressions that outputs need.
    fn needed(&self, outputs: &[Output]) -> Vec<Id> {
        let ids = outputs.iter().flat_map(|output| self.cells.elements(&output.value));
        let mut ids: Vec<Id> = ids.filter_map(|element| value(&element)).map(|(id, _)| id).collect();
        ids.dedup();
        self.exprs.needed_instead(&ids, &self.cells.instead)
    }
}

/// Parts of names of what a network remembers.
const MEMORY: [&str; 20] = [
    "hidden", "memory", "history", "hist", "carry", "h", "h0", "h1", "hn", "c", "c0", "c1", "cn", "prev", "previous",
    "last", "old", "buffer", "lstm", "gru",
];

/// Splits a name into lower-case parts.
fn parts(name: &str) -> impl Iterator<Item = String> {
    let parts = name.split(|c: char| !c.is_ascii_alphanumeric()).map(str::to_lowercase);
    parts.collect::<Vec<_>>().into_iter()
}

/// Returns `true` if two names are those of one state, before a step and after it.
fn are_sides(before: &str, after: &str) -> bool {
    let of_state = |name: &str| {
        let lower = name.to_lowercase();
        let mut parts = lower.split(|c: char| !c.is_ascii_alphanumeric());
        parts.any(|part| {
            ["state", "states", "hidden", "memory", "history", "hist", "carry", "h", "h0", "h1", "hn"].contains(&part)
        })
    };
    // Words that only together say what they are.
    let opposite = [("init", "final"), ("initial", "final"), ("past", "present")];
    let without = |name: &str, word: &str| {
        let rest: Vec<String> = parts(name).filter(|part| part != word).collect();
        (rest.len() < parts(name).count()).then(|| stem(&rest.join("_")))
    };
    if opposite.iter().any(|(a, b)| without(before, a).is_some_and(|rest| without(after, b) == Some(rest))) {
        return true;
    }
    let (from, to) = (stem(before), stem(after));
    // state_in and state_out have nothing else in their names; history and updated_history have more in one.
    let is_within = from.is_empty() || to.is_empty() || from.contains(&to) || to.contains(&from);
    from == to && !from.is_empty() || of_state(before) && of_state(after) && is_within
}

/// Returns `true` if an output consists of states of cells.
pub(crate) fn is_state(cells: &Cells, exprs: &Exprs, value: &Tensor) -> bool {
    cells.elements(value).iter().all(|e| match *e {
        Element::Of(id, _) => matches!(exprs.get(id), Expr::CellState(_) | Expr::Cell(_)),
        Element::Known(_) => false,
    })
}

#[cfg(test)]
mod tests {
    use super::are_sides;

    #[test]
    fn names_of_states_before_and_after_steps_pair() {
        for (before, after) in [
            ("h_in", "h_out"),
            ("state_in", "state_out"),
            ("state_in_0", "state_out_0"),
            ("state", "next_state"),
            ("prev_state", "new_state"),
            ("h0", "h1"),
            ("h_t", "h_t1"),
            ("history", "updated_history"),
            ("lstm.hidden", "lstm.hidden.next"),
            ("init_state", "final_state"),
            ("past", "present"),
            ("past_mem.0", "present_mem.0"),
        ] {
            assert!(are_sides(before, after), "{before} {after}");
        }
        for (before, after) in [
            ("obs", "obs_reconstructed"),
            ("command", "estimate"),
            ("input", "value"),
            ("state", "value"),
            ("robot_state", "goal_state"),
            ("history", "latent"),
            ("present_position", "position"),
            ("past_mem", "present_key"),
        ] {
            assert!(!are_sides(before, after), "{before} {after}");
        }
    }
}
