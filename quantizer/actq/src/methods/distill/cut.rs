//! Removal of units: all their rows and columns at once. The matrices that read them take over what they contributed.

use super::compact::{absorb, add_to_bias, columns, rows};
use super::units::{Units, units};
use crate::calibrate::moments::Moments;
use crate::graph::units::unit_rows;
use crate::graph::{Graph, WeightMatrix};

/// Returns the number of a units in a share.
fn kept_of(units: &Units, share: f64) -> usize {
    ((units.len as f64 * share).ceil() as usize).clamp(1, units.len)
}

/// A graph that has lost units.
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

    /// Keeps the given share of all units, whichever, and only to count bytes.
    pub(super) fn outline(graph: &Graph, share: f64) -> Self {
        let mut cut = Self::nothing(graph);
        for units in units(graph) {
            let all: Vec<usize> = (0..units.len).collect();
            let (kept, gone) = all.split_at(kept_of(&units, share));
            cut.keep(&units, kept, gone, None);
        }
        cut
    }

    /// Keeps the given share of all units: those with the largest `removals`. The contribution of the others
    /// is estimated from these by the moments of every matrix's input.
    pub(super) fn to(graph: &Graph, units: &[Units], removals: &[Vec<f64>], share: f64, moments: &[&Moments]) -> Self {
        let mut cut = Self::nothing(graph);
        for (units, removals) in units.iter().zip(removals) {
            let mut ranked: Vec<usize> = (0..units.len).collect();
            ranked.sort_by(|&a, &b| removals[b].total_cmp(&removals[a]));
            let gone = ranked.split_off(kept_of(units, share));
            if gone.is_empty() {
                continue;
            }
            ranked.sort_unstable();
            cut.error += gone.iter().map(|&unit| removals[unit]).sum::<f64>();
            cut.keep(units, &ranked, &gone, Some(moments));
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

    /// Removes the units `gone`; without moments their contribution is lost.
    fn keep(&mut self, units: &Units, kept: &[usize], gone: &[usize], moments: Option<&[&Moments]>) {
        let graph = &mut self.graph;
        for &m in &units.makers {
            self.rows[m] = unit_rows(graph.matrices[m].rows, units.len, kept);
            graph.matrices[m] = rows(&graph.matrices[m], &self.rows[m]);
        }
        for &node in &units.nodes {
            graph.nodes[node].kind.keep_units(units.len, kept);
            graph.nodes[node].len = kept.len();
        }
        for &m in units.readers.iter().flatten() {
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
    use crate::testing::{dataset, gru, lstm, residual};

    /// Runs a graph over some observations.
    fn outputs(graph: &Graph) -> Vec<Vec<f32>> {
        let mut evaluator = Evaluator::new(graph);
        let obs = |t: usize| (0..graph.obs_len).map(|i| (0.7 * (t + 3 * i) as f32).sin()).collect::<Vec<_>>();
        (0..20).map(|t| evaluator.step(&obs(t), &mut |_, _| {})).collect()
    }

    #[test]
    fn units_that_nothing_reads_go_without_a_trace() {
        for mut graph in [lstm(), gru(4), residual(false)] {
            let set = units(&graph).remove(0);
            let gone = [1, set.len - 1];
            for &m in set.readers.iter().flatten() {
                let WeightMatrix { cols, data, .. } = &mut graph.matrices[m];
                data.chunks_mut(*cols).for_each(|row| gone.iter().for_each(|&unit| row[unit] = 0.0));
            }
            let moments = collect(&graph, &dataset(&graph, 2, 100), &mut |_| {});
            let moments: Vec<&Moments> = moments.iter().collect();
            let g: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
            let removals = set.removals(&graph, &moments, &g);
            let kept = set.len - gone.len();
            let share = kept as f64 / set.len as f64;
            let cut = Cut::to(&graph, std::slice::from_ref(&set), &[removals], share, &moments);
            assert_eq!(cut.graph.state_len() * set.len, graph.state_len() * kept);
            assert!(cut.error < 1e-9, "{}", cut.error);
            for (a, b) in outputs(&graph).iter().flatten().zip(outputs(&cut.graph).iter().flatten()) {
                assert!((a - b).abs() < 1e-5, "{a} and {b}");
            }
            let m = set.makers[0];
            let rows = cut.whole(m, vec![true; cut.rows[m].len()], false);
            assert!((0..rows.len()).all(|row| rows[row] != gone.contains(&(row % set.len))));
        }
    }
}
