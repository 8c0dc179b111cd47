//! Hidden units of recurrent cells, and their removal. A unit has a row of every gate and a column of every matrix that
//! reads the state, so a cell with fewer units is far smaller than one that lacks as many rows.

use super::compact::{absorb, add_to_bias, columns, rows};
use super::dimension::{consumers, elementwise};
use super::removal::Effect;
use crate::calibrate::moments::Moments;
use crate::graph::operation::Operand;
use crate::graph::ops::unit_rows;
use crate::graph::{Graph, WeightMatrix};

/// A recurrent cell whose units reach only matrices. Numbers are indices of the graph's matrices.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    node: usize,
    /// Hidden units.
    pub(super) hidden: usize,
    /// Matrices with a row of each unit for every gate.
    pub(super) makers: Vec<usize>,
    /// Matrices with a column of each unit, first that of the cell itself.
    pub(super) consumers: Vec<usize>,
}

/// Finds the cells of a graph.
pub(super) fn cells(graph: &Graph) -> Vec<Cell> {
    (0..graph.nodes.len()).filter_map(|node| cell(graph, node)).collect()
}

fn cell(graph: &Graph, node: usize) -> Option<Cell> {
    let kind = &graph.nodes[node].kind;
    let products = kind.products();
    let own = products.iter().find(|product| product.operand == Operand::State)?;
    let makers: Vec<usize> = products.iter().map(|product| product.matrix).collect();
    let value = elementwise(graph, node)?.last().map_or(node, |last| *last) + 1;
    let readers =
        graph.readers(value).into_iter().map(|reader| consumers(graph, reader)).collect::<Option<Vec<_>>>()?;
    let others = readers.concat();
    let once = |m: &usize| graph.runs(*m) == 1;
    let apart = !others.is_empty() && others.iter().chain(&makers).all(once);
    let consumers = [own.matrix].into_iter().chain(others).collect();
    apart.then(|| Cell { node, hidden: kind.state_lens()[0], makers, consumers })
}

impl Cell {
    /// Returns the errors of removing each unit together with those that matter less.
    pub(super) fn removals(&self, graph: &Graph, moments: &[&Moments], g: &[Vec<f64>]) -> Vec<f64> {
        Effect::of(graph, &self.consumers, moments, g).together()
    }
}

/// Returns the number of a cell's units in a share.
fn kept_of(cell: &Cell, share: f64) -> usize {
    ((cell.hidden as f64 * share).ceil() as usize).clamp(1, cell.hidden)
}

/// A graph whose cells have lost units.
#[derive(Clone, Debug)]
pub(super) struct Cut {
    /// The graph.
    pub(super) graph: Graph,
    /// Former rows and columns of every matrix.
    pub(super) rows: Vec<Vec<usize>>,
    pub(super) columns: Vec<Vec<usize>>,
    /// Number of rows of every matrix before.
    former: Vec<usize>,
    /// Error of the removed units.
    pub(super) error: f64,
}

impl Cut {
    /// Removes nothing.
    pub(super) fn nothing(graph: &Graph) -> Self {
        let all = |of: fn(&WeightMatrix) -> usize| graph.matrices.iter().map(|m| (0..of(m)).collect()).collect();
        let former = graph.matrices.iter().map(|m| m.rows).collect();
        Self { graph: graph.clone(), rows: all(|m| m.rows), columns: all(|m| m.cols), former, error: 0.0 }
    }

    /// Keeps the given share of every cell's units, whichever, and only to count bytes.
    pub(super) fn outline(graph: &Graph, share: f64) -> Self {
        let mut cut = Self::nothing(graph);
        for cell in cells(graph) {
            let units: Vec<usize> = (0..cell.hidden).collect();
            let (kept, gone) = units.split_at(kept_of(&cell, share));
            cut.keep(&cell, kept, gone, None);
        }
        cut
    }

    /// Keeps the given share of every cell's units: those with the largest `removals`. The contribution of the others
    /// is estimated from these by the moments of every matrix's input.
    pub(super) fn to(graph: &Graph, cells: &[Cell], removals: &[Vec<f64>], share: f64, moments: &[&Moments]) -> Self {
        let mut cut = Self::nothing(graph);
        for (cell, removals) in cells.iter().zip(removals) {
            let mut ranked: Vec<usize> = (0..cell.hidden).collect();
            ranked.sort_by(|&a, &b| removals[b].total_cmp(&removals[a]));
            let gone = ranked.split_off(kept_of(cell, share));
            if gone.is_empty() {
                continue;
            }
            ranked.sort_unstable();
            cut.error += gone.iter().map(|&unit| removals[unit]).sum::<f64>();
            cut.keep(cell, &ranked, &gone, Some(moments));
        }
        cut
    }

    /// Returns the error of each removed row.
    pub(super) fn error_of_row(&self) -> f64 {
        let removed: usize = self.former.iter().zip(&self.rows).map(|(former, rows)| former - rows.len()).sum();
        self.error / removed.max(1) as f64
    }

    /// Returns values of the rows of matrix `m` before the cut, with `gone` for removed ones.
    pub(super) fn whole<T: Copy>(&self, m: usize, values: Vec<T>, gone: T) -> Vec<T> {
        let mut whole = vec![gone; self.former[m]];
        self.rows[m].iter().zip(values).for_each(|(&row, value)| whole[row] = value);
        whole
    }

    /// Removes the units `gone` of a cell; without moments their contribution is lost.
    fn keep(&mut self, cell: &Cell, kept: &[usize], gone: &[usize], moments: Option<&[&Moments]>) {
        let graph = &mut self.graph;
        for &m in &cell.makers {
            self.rows[m] = unit_rows(graph.matrices[m].rows, cell.hidden, kept);
            graph.matrices[m] = rows(&graph.matrices[m], &self.rows[m]);
        }
        graph.nodes[cell.node].kind.keep_units(kept);
        graph.nodes[cell.node].len = kept.len();
        for node in elementwise(graph, cell.node).unwrap_or_default() {
            graph.nodes[node].len = kept.len();
        }
        for &m in &cell.consumers {
            let contribution = moments.map(|moments| absorb(&mut graph.matrices[m], gone, kept, moments[m]));
            graph.matrices[m] = columns(&graph.matrices[m], kept);
            self.columns[m] = kept.to_vec();
            contribution.iter().for_each(|contribution| add_to_bias(graph, m, contribution));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::moments::collect;
    use crate::graph::Evaluator;
    use crate::testing::{dataset, gru, lstm};

    /// Runs a graph over some observations.
    fn outputs(graph: &Graph) -> Vec<Vec<f32>> {
        let mut evaluator = Evaluator::new(graph);
        let obs = |t: usize| (0..graph.obs_len).map(|i| (0.7 * (t + 3 * i) as f32).sin()).collect::<Vec<_>>();
        (0..20).map(|t| evaluator.step(&obs(t), &mut |_, _| {})).collect()
    }

    #[test]
    fn units_that_nothing_reads_go_without_a_trace() {
        for mut graph in [lstm(), gru(4)] {
            let cell = cells(&graph).remove(0);
            let gone = [1, cell.hidden - 1];
            for &m in &cell.consumers {
                let WeightMatrix { cols, data, .. } = &mut graph.matrices[m];
                data.chunks_mut(*cols).for_each(|row| gone.iter().for_each(|&unit| row[unit] = 0.0));
            }
            let moments = collect(&graph, &dataset(&graph, 2, 100), &mut |_| {});
            let moments: Vec<&Moments> = moments.iter().collect();
            let g: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
            let removals = cell.removals(&graph, &moments, &g);
            let kept = cell.hidden - gone.len();
            let share = kept as f64 / cell.hidden as f64;
            let cut = Cut::to(&graph, std::slice::from_ref(&cell), &[removals], share, &moments);
            assert_eq!(cut.graph.state_len() * cell.hidden, graph.state_len() * kept);
            assert!(cut.error < 1e-9, "{}", cut.error);
            for (a, b) in outputs(&graph).iter().flatten().zip(outputs(&cut.graph).iter().flatten()) {
                assert!((a - b).abs() < 1e-5, "{a} and {b}");
            }
            let m = cell.makers[0];
            let rows = cut.whole(m, vec![true; cut.rows[m].len()], false);
            assert!((0..rows.len()).all(|row| rows[row] != gone.contains(&(row % cell.hidden))));
        }
    }
}
