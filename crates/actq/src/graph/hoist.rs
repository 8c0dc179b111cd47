//! Turns a network of observation, time and iterate into an iterative head that computes nothing twice.
//!
//! Values that depend on the time alone become a table, since the steps are known when the image is built. Values that
//! depend on the observation alone are computed once per output. A linear layer over several of these,
//! concatenated, is split into their columns, and a function of them into functions of each.

use ndarray::Array2;

use super::denoising::Denoising;
use super::nodes::{Graph, Node};
use super::ops::{Add, Concat, Iterate, Linear, NodeKind, Pointwise, Span, Table};
use super::run::Network;
use super::values::{ValueId, WeightMatrix};
use super::weights::{Weights, zero_state};
use crate::error::{Context, Result, ensure};

/// Dependence of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Needs {
    Time,
    Observation,
    /// The iterate, or time and observation both.
    Step,
}

impl Needs {
    fn with(self, other: Self) -> Self {
        if self == other { self } else { Self::Step }
    }
}

/// Makes the head that runs `flat`, a network of `[observation | time | iterate]`, in the steps of `denoising`. `times`
/// holds its time input in each step.
pub fn iterative(flat: &Graph, obs_len: usize, times: &[Vec<f32>], steps: Denoising) -> Result<Graph> {
    let time_len = times.first().map_or(0, Vec::len);
    ensure!(
        steps.steps.len() == times.len() && !times.is_empty(),
        "the schedule has {} times for {} steps",
        times.len(),
        steps.steps.len()
    );
    ensure!(
        obs_len + time_len + steps.len == flat.obs_len,
        "observation, time and iterate do not add up to the network's input"
    );
    ensure!(flat.state_len() == 0, "a recurrent network cannot be the head of a flow or a diffusion policy");
    let out = flat.len_of(flat.output());
    ensure!(out == steps.len, "the last op gives {out} values, but the iterate has {}", steps.len);
    let flat = &with_functions_apart(flat, obs_len, time_len, times.len())?;
    // The observation does not affect values that depend on the time alone.
    let rows = Array2::from_shape_fn((times.len(), flat.obs_len), |(k, i)| {
        times[k].get(i.wrapping_sub(obs_len)).copied().unwrap_or(0.0)
    });
    let pass = Network::new(flat).forward(&Weights::of(flat), rows, &mut zero_state(flat, times.len()));
    let needs = needs(flat, obs_len, time_len)?;
    ensure!(needs[flat.output()] == Needs::Step, "the output does not depend on the iterate");
    let mut hoist = Hoist {
        flat,
        spans: [0..obs_len, obs_len..obs_len + time_len, obs_len + time_len..flat.obs_len],
        needs,
        tables: pass.values,
        graph: Graph { prefix_len: flat.prefix_len, ..Graph::new(obs_len) },
        places: vec![None; flat.nodes.len() + 1],
        condition: vec![None; flat.nodes.len() + 1],
        iterate: 0,
        len: steps.len,
    };
    hoist.add_observation_nodes()?;
    let first = hoist.graph.nodes.len();
    hoist.add_step_nodes()?;
    let mut graph = hoist.graph;
    graph.denoising = Some(Denoising { first, ..steps });
    Ok(graph)
}

/// Bits of a value in a table, and of a weight that it takes the place of.
const TABLE_BITS: usize = 32;
const WEIGHT_BITS: usize = 3;

/// Returns the network with a function of each part of a concatenation, if the parts differ in dependence, and if a table
/// over the `times` is no longer than the weights of a layer that reads the time's part.
fn with_functions_apart(flat: &Graph, obs_len: usize, time_len: usize, times: usize) -> Result<Graph> {
    let needs = needs(flat, obs_len, time_len)?;
    let of_part = |(value, span): &(ValueId, Span)| needs_of(&needs, *value, span, obs_len, time_len);
    let mut graph = Graph { nodes: Vec::new(), ..flat.clone() };
    let mut places = vec![0];
    for node in &flat.nodes {
        let parts = concatenated(flat, node).unwrap_or_default();
        let runs: Vec<_> = parts.chunk_by(|a, b| of_part(a) == of_part(b)).collect();
        let of_time: usize = parts.iter().filter(|part| of_part(part) == Needs::Time).map(|(_, span)| span.len).sum();
        let is_apart = runs.len() > 1 && (of_time == 0 || TABLE_BITS * times <= WEIGHT_BITS * of_time);
        let place = match &node.kind {
            NodeKind::Pointwise(Pointwise(function)) if is_apart => {
                let mut results = Vec::new();
                for run in runs {
                    let part = graph.join(run.iter().map(|(value, span)| (places[*value], *span)).collect())?;
                    let result = graph.add(Pointwise(*function), &[part])?;
                    results.push((result, Span { from: 0, len: graph.len_of(result) }));
                }
                graph.join(results)?
            }
            kind => graph.add(kind.clone(), &node.inputs.iter().map(|&value| places[value]).collect::<Vec<_>>())?,
        };
        places.push(place);
    }
    Ok(graph)
}

/// Returns the parts of the concatenation that a node reads; `None` if it reads no concatenation.
fn concatenated(flat: &Graph, node: &Node) -> Option<Vec<(ValueId, Span)>> {
    let input = &flat.nodes[node.inputs.first()?.checked_sub(1)?];
    let NodeKind::Concat(Concat(spans)) = &input.kind else { return None };
    Some(input.inputs.iter().copied().zip(spans.iter().copied()).collect())
}

/// Returns the dependence of every value; the observation of the flat network, which holds all three parts, counts as
/// the step.
fn needs(flat: &Graph, obs_len: usize, time_len: usize) -> Result<Vec<Needs>> {
    let mut needs = vec![Needs::Step];
    for node in &flat.nodes {
        let of = match &node.kind {
            NodeKind::Concat(Concat(spans)) => {
                let part = |(&value, span): (&ValueId, &Span)| -> Result<Needs> {
                    if value != 0 {
                        return Ok(needs[value]);
                    }
                    of_input(span, obs_len, time_len)
                        .context("a part spans more than one of observation, time and iterate")
                };
                node.inputs.iter().zip(spans).map(part).collect::<Result<Vec<_>>>()?
            }
            _ => node.inputs.iter().map(|&value| needs[value]).collect(),
        };
        needs.push(of.into_iter().reduce(Needs::with).unwrap_or(Needs::Step));
    }
    Ok(needs)
}

/// Returns the dependence of a part of a value.
fn needs_of(needs: &[Needs], value: ValueId, span: &Span, obs_len: usize, time_len: usize) -> Needs {
    if value == 0 { of_input(span, obs_len, time_len).unwrap_or(Needs::Step) } else { needs[value] }
}

/// Returns the part of the flat network's input that a span is in.
fn of_input(span: &Span, obs_len: usize, time_len: usize) -> Option<Needs> {
    let (from, to) = (span.from, span.from + span.len);
    if to <= obs_len {
        Some(Needs::Observation)
    } else if from >= obs_len && to <= obs_len + time_len {
        Some(Needs::Time)
    } else {
        (from >= obs_len + time_len).then_some(Needs::Step)
    }
}

struct Hoist<'a> {
    flat: &'a Graph,
    /// Ranges of observation, time and iterate in the flat network's input.
    spans: [std::ops::Range<usize>; 3],
    needs: Vec<Needs>,
    /// Values of the flat network at each time.
    tables: Vec<Array2<f32>>,
    /// The new graph.
    graph: Graph,
    /// The new graph's values for those of the flat network.
    places: Vec<Option<ValueId>>,
    /// The observation's share of a split linear layer.
    condition: Vec<Option<ValueId>>,
    iterate: ValueId,
    len: usize,
}

impl Hoist<'_> {
    /// Adds nodes of the observation alone, and the observation's columns of split layers.
    fn add_observation_nodes(&mut self) -> Result<()> {
        let flat = self.flat;
        for (i, node) in flat.nodes.iter().enumerate() {
            if self.needs[i + 1] == Needs::Observation {
                self.copy(i)?;
            } else if let Some((linear, parts)) = self.split_layer(node) {
                // The biases are in the table if there is one, else here.
                let biased = parts.iter().all(|(.., needs)| *needs != Needs::Time);
                self.condition[i + 1] = self.columns(linear, &parts, Needs::Observation, biased)?;
            }
        }
        Ok(())
    }

    /// Adds all remaining nodes except those of the time alone.
    fn add_step_nodes(&mut self) -> Result<()> {
        let flat = self.flat;
        self.iterate = self.graph.add(Iterate { len: self.len }, &[])?;
        for (i, node) in flat.nodes.iter().enumerate() {
            if self.needs[i + 1] != Needs::Step || self.feeds_only_split_layers(i) {
                continue;
            }
            let Some((linear, parts)) = self.split_layer(node) else {
                self.copy(i)?;
                continue;
            };
            let table = self.table_of(linear, &parts);
            let biased = table.is_none() && self.condition[i + 1].is_none();
            let mut sum = self.columns(linear, &parts, Needs::Step, biased)?;
            let mut add = |graph: &mut Graph, value: ValueId| -> Result<()> {
                sum = Some(match sum {
                    Some(sum) => graph.add(Add, &[sum, value])?,
                    None => value,
                });
                Ok(())
            };
            if let Some(table) = table {
                let value = self.graph.add(table, &[])?;
                add(&mut self.graph, value)?;
            }
            if let Some(condition) = self.condition[i + 1] {
                add(&mut self.graph, condition)?;
            }
            self.places[i + 1] = sum;
        }
        Ok(())
    }

    /// Returns `true` if only split layers read the parts that this node concatenates.
    fn feeds_only_split_layers(&self, i: usize) -> bool {
        let readers = self.flat.readers(i + 1);
        matches!(self.flat.nodes[i].kind, NodeKind::Concat(_))
            && !readers.is_empty()
            && i + 1 != self.flat.output()
            && readers.iter().all(|&reader| self.split_layer(&self.flat.nodes[reader]).is_some())
    }

    /// Returns a linear layer over parts of different dependence, with the parts: value, span, dependence.
    #[expect(clippy::type_complexity, reason = "the line above names the parts")]
    fn split_layer<'n>(&self, node: &'n Node) -> Option<(&'n Linear, Vec<(ValueId, Span, Needs)>)> {
        let NodeKind::Linear(linear) = &node.kind else { return None };
        let parts = concatenated(self.flat, node)?.into_iter();
        let parts: Vec<_> = parts.map(|(value, span)| (value, span, self.needs_of(value, &span))).collect();
        let first = parts.first()?.2;
        parts.iter().any(|(.., needs)| *needs != first).then_some((linear, parts))
    }

    fn needs_of(&self, value: ValueId, span: &Span) -> Needs {
        let [obs, time, _] = &self.spans;
        needs_of(&self.needs, value, span, obs.len(), time.len())
    }

    /// Returns the time's share of a split layer, with its biases; `None` if it has none.
    fn table_of(&self, linear: &Linear, parts: &[(ValueId, Span, Needs)]) -> Option<Table> {
        let matrix = &self.flat.matrices[linear.matrix];
        let mut rows = Vec::new();
        for k in 0..self.tables[0].nrows() {
            for (row, bias) in matrix.data.chunks_exact(matrix.cols).zip(&linear.bias) {
                let mut sum = f64::from(*bias);
                let mut col = 0;
                for (value, span, needs) in parts {
                    if *needs == Needs::Time {
                        let x = self.tables[*value].row(k);
                        sum +=
                            (0..span.len).map(|i| f64::from(row[col + i]) * f64::from(x[span.from + i])).sum::<f64>();
                    }
                    col += span.len;
                }
                rows.push(sum as f32);
            }
        }
        parts.iter().any(|(.., needs)| *needs == Needs::Time).then_some(Table { rows, len: matrix.rows })
    }

    /// Adds the layer of those columns whose parts have this dependence; `None` if there are none.
    fn columns(
        &mut self,
        linear: &Linear,
        parts: &[(ValueId, Span, Needs)],
        which: Needs,
        biased: bool,
    ) -> Result<Option<ValueId>> {
        let whole = &self.flat.matrices[linear.matrix];
        let mut columns = Vec::new();
        let mut chosen = Vec::new();
        let mut col = 0;
        for (value, span, needs) in parts {
            if *needs == which {
                columns.extend(col..col + span.len);
                chosen.push((*value, *span));
            }
            col += span.len;
        }
        if columns.is_empty() {
            return Ok(None);
        }
        let part = if which == Needs::Observation { "observation" } else { "iterate" };
        let data = whole.data.chunks_exact(whole.cols).flat_map(|row| columns.iter().map(|&c| row[c])).collect();
        let name = format!("{} ({part})", whole.name);
        let (rows, cols) = (whole.rows, columns.len());
        let matrix = self.graph.share_matrix(WeightMatrix { name, rows, cols, data })?;
        let bias = if biased { linear.bias.clone() } else { vec![0.0; rows] };
        let input = self.joined(chosen)?;
        self.graph.add(Linear { matrix, bias }, &[input]).map(Some)
    }

    /// Copies a node with its matrices.
    fn copy(&mut self, i: usize) -> Result<()> {
        let node = &self.flat.nodes[i];
        let mut kind = node.kind.clone();
        if let NodeKind::Linear(linear) = &mut kind {
            let matrix = &self.flat.matrices[linear.matrix];
            linear.matrix = self.graph.share_matrix(matrix.clone())?;
        }
        let place = if let NodeKind::Concat(Concat(spans)) = &kind {
            self.joined(node.inputs.iter().copied().zip(spans.iter().copied()).collect())?
        } else {
            let inputs = node.inputs.iter().map(|&value| self.place(value)).collect::<Result<Vec<_>>>()?;
            self.graph.add(kind, &inputs)?
        };
        self.places[i + 1] = Some(place);
        Ok(())
    }

    /// Concatenates parts of the flat network's values.
    fn joined(&mut self, mut parts: Vec<(ValueId, Span)>) -> Result<ValueId> {
        let [_, time, iterate] = self.spans.clone();
        for (value, span) in &mut parts {
            (*value, span.from) = match (*value, self.needs_of(*value, span)) {
                (0, Needs::Observation) => (0, span.from),
                (0, Needs::Time) => {
                    let rows = self.tables[0].rows().into_iter();
                    let rows = rows.flat_map(|row| row.to_vec()[time.clone()].to_vec()).collect();
                    (self.graph.add(Table { rows, len: time.len() }, &[])?, span.from - time.start)
                }
                (0, Needs::Step) => (self.iterate, span.from - iterate.start),
                (value, _) => (self.place(value)?, span.from),
            };
        }
        self.graph.join(parts)
    }

    /// Returns the new value for one of the flat network; a table for a value of the time alone.
    fn place(&mut self, value: ValueId) -> Result<ValueId> {
        if let Some(place) = self.places[value] {
            return Ok(place);
        }
        ensure!(
            value != 0 && self.needs[value] == Needs::Time,
            "an op reads observation, time and iterate as one value; give it them as separate parts"
        );
        let (rows, len) = (self.tables[value].iter().copied().collect(), self.tables[value].ncols());
        let table = self.graph.add(Table { rows, len }, &[])?;
        self.places[value] = Some(table);
        Ok(table)
    }
}
