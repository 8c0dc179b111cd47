//! Removal of units: all their rows and columns at once. The matrices that read them take over what they contributed.

use super::compact::{absorb, add_to_bias};
use super::heads::{HeadUnits, ranked};
use super::units::{Units, units};
use crate::calibrate::moments::Moments;
use crate::graph::narrow::{Narrowed, narrowed};
use crate::graph::ties::Ties;
use crate::graph::{Graph, WeightMatrix};

/// Units that a network can lose.
#[derive(Clone, Debug)]
pub(super) struct Removable {
    /// Units with their errors of removal.
    pub(super) units: Vec<(Units, Vec<f64>)>,
    pub(super) heads: Vec<HeadUnits>,
}

/// Units that a network keeps.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    /// Share of the units.
    pub(super) share: f64,
    /// Heads of every attention, and elements of each.
    pub(super) heads: Vec<[usize; 2]>,
}

/// Returns the number of units in a share.
fn kept_units(units: &Units, share: f64) -> usize {
    ((units.len as f64 * share).ceil() as usize).clamp(1, units.len)
}

/// A graph that has lost units.
#[derive(Clone, Debug)]
pub(super) struct Cut {
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

    /// Keeps the given share of all units, the first ones, and the fewest heads: for counting bytes only.
    pub(super) fn for_size(graph: &Graph, share: f64) -> Self {
        let ties = Ties::of(graph);
        let mut kept = ties.whole();
        units(graph, &ties).iter().for_each(|units| kept[units.group].truncate(kept_units(units, share)));
        for heads in HeadUnits::of(graph, &ties, None) {
            let [fewest, least] = [0, 1].map(|which| heads.shares(which, &[share]));
            heads.keep([fewest[0], least[0]], &mut kept);
        }
        Self::nothing(graph).keep(&ties, &kept)
    }

    /// Keeps some of all units: those with the largest errors of removal. The contribution of the others is estimated from
    /// these by the moments of every matrix's input.
    pub(super) fn keep_some(graph: &Graph, removable: &Removable, kept: &Kept, moments: &[&Moments]) -> Self {
        let ties = Ties::of(graph);
        let mut elements = ties.whole();
        let mut cut = Self::nothing(graph);
        for (units, removals) in &removable.units {
            let (stay, gone) = ranked(removals, kept_units(units, kept.share));
            cut.error += gone.iter().map(|&unit| removals[unit]).sum::<f64>();
            elements[units.group] = stay;
        }
        for (heads, sizes) in removable.heads.iter().zip(&kept.heads) {
            cut.error += heads.keep(*sizes, &mut elements);
        }
        for (m, of) in moments.iter().enumerate() {
            let columns = ties.places(&ties.cols[m], &elements);
            let gone: Vec<usize> =
                (0..cut.graph.matrices[m].cols).filter(|c| columns.binary_search(c).is_err()).collect();
            if !gone.is_empty() {
                let contribution = absorb(&mut cut.graph.matrices[m], &gone, &columns, of);
                add_to_bias(&mut cut.graph, m, &contribution);
            }
        }
        cut.keep(&ties, &elements)
    }

    /// Removes all elements but these of each group.
    fn keep(self, ties: &Ties, kept: &[Vec<usize>]) -> Self {
        let Narrowed { graph, rows, columns } = narrowed(&self.graph, ties, kept);
        Self { graph, rows, columns, ..self }
    }

    /// Returns the error of each removed row.
    pub(super) fn error_of_row(&self) -> f64 {
        let removed: usize = self.former.iter().zip(&self.rows).map(|(former, rows)| former - rows.len()).sum();
        self.error / removed.max(1) as f64
    }

    /// Returns values of the rows of matrix `m` before the cut, with `gone` for removed ones.
    pub(super) fn expand<T: Copy>(&self, m: usize, values: Vec<T>, gone: T) -> Vec<T> {
        let mut all = vec![gone; self.former[m]];
        self.rows[m].iter().zip(values).for_each(|(&row, value)| all[row] = value);
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::moments::collect;
    use crate::testing::{branches, dataset, gru, lstm, outputs, residual};

    #[test]
    fn units_that_nothing_reads_go_without_a_trace() {
        for mut graph in [lstm(), gru(4), residual(4, false), branches([4, 3])] {
            let ties = Ties::of(&graph);
            let set = units(&graph, &ties).remove(0);
            let gone = [1, set.len - 1];
            for reading in &set.readers {
                for &m in &reading.matrices {
                    let WeightMatrix { cols, data, .. } = &mut graph.matrices[m];
                    let columns = gone.map(|unit| reading.columns.start + unit);
                    data.chunks_mut(*cols).for_each(|row| columns.iter().for_each(|&c| row[c] = 0.0));
                }
            }
            let moments = collect(&graph, &dataset(&graph, 2, 100), &mut |_| {});
            let moments: Vec<&Moments> = moments.iter().collect();
            let g: Vec<Vec<f64>> = graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect();
            let removals = set.removals(&graph, &moments, &g);
            let kept = set.len - gone.len();
            let share = kept as f64 / set.len as f64;
            let removable = Removable { units: vec![(set.clone(), removals)], heads: Vec::new() };
            let cut = Cut::keep_some(&graph, &removable, &Kept { share, heads: Vec::new() }, &moments);
            assert_eq!(cut.graph.state_len() * set.len, graph.state_len() * kept);
            assert!(cut.error < 1e-9, "{}", cut.error);
            for (a, b) in outputs(&graph).iter().flatten().zip(outputs(&cut.graph).iter().flatten()) {
                assert!((a - b).abs() < 1e-5, "{a} and {b}");
            }
            let m = ties.rows.iter().position(|(_, layout)| layout.contains(&set.group)).expect("a matrix makes them");
            let rows = cut.expand(m, vec![true; cut.rows[m].len()], false);
            assert!((0..rows.len()).all(|row| rows[row] != gone.contains(&(row % set.len))));
        }
    }
}
