//! Units of attention: whole heads, and equally many elements of every head. A head has keys, with the queries that are
//! multiplied with them, and values.

use super::units::Units;
use crate::calibrate::moments::Moments;
use crate::graph::Graph;
use crate::graph::ties::{Heads, Ties};

/// Elements of a head are kept in such multiples: the kernels read as many at once.
const STEP: usize = 4;

/// Measurements of a network.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    /// Moments of every matrix's input.
    pub(super) moments: &'a [&'a Moments],
    /// Importance of every matrix's rows.
    pub(super) g: &'a [Vec<f64>],
    /// Error of each row of every matrix that is constant in its place, if known.
    pub(super) constant: &'a [Option<Vec<f64>>],
}

/// Heads of an attention.
#[derive(Clone, Debug)]
pub(super) struct HeadUnits {
    keys: Vec<Part>,
    values: Vec<Part>,
}

/// The keys or values of a head.
#[derive(Clone, Debug)]
struct Part {
    /// Their group of the network's elements.
    group: usize,
    /// Error of removing each element.
    errors: Vec<f64>,
}

impl HeadUnits {
    /// Finds the heads of every attention that reaches only matrices. Without measurements, all errors are 0.
    pub(super) fn of(graph: &Graph, ties: &Ties, measured: Option<Measured<'_>>) -> Vec<Self> {
        let of_heads = |Heads { keys, values }: &Heads| {
            let of_values = |&group: &usize| {
                let units = Units::of(graph, ties, group)?;
                let errors = measured.map(|of| units.removals(graph, of.moments, of.g));
                Some(Part { group, errors: errors.unwrap_or_else(|| vec![0.0; units.len]) })
            };
            // Keys that a matrix reads, or none makes, have effects that are not measured.
            let is_product = |group: &usize| {
                let is_made = ties.rows.iter().any(|(_, rows)| rows.contains(group));
                is_made && ties.cols.iter().all(|columns| !columns.contains(group))
            };
            let of_keys = |&group: &usize| Part { group, errors: products(ties, group, measured) };
            let values: Option<Vec<Part>> = values.iter().map(of_values).collect();
            keys.iter().all(is_product).then_some(Self { keys: keys.iter().map(of_keys).collect(), values: values? })
        };
        ties.heads.iter().filter_map(of_heads).collect()
    }

    /// Returns the numbers of heads and of elements of each.
    pub(super) fn sizes(&self) -> [usize; 2] {
        [self.values.len(), self.values[0].errors.len()]
    }

    /// Returns these shares of one of the sizes, descending.
    pub(super) fn shares(&self, which: usize, shares: &[f64]) -> Vec<usize> {
        let size = self.sizes()[which];
        // Positions that rotate keys keep their elements.
        let is_whole = which == 1 && self.keys[0].errors.len() < size;
        let multiple = if which == 1 { STEP } else { 1 };
        let of = |share: &f64| ((size as f64 * share).ceil() as usize).next_multiple_of(multiple).min(size);
        let mut all: Vec<usize> = if is_whole { vec![size] } else { shares.iter().map(of).collect() };
        all.dedup();
        all
    }

    /// Keeps these numbers of heads and of elements of each: those with the largest errors. Returns the error of the others. `kept`
    /// has the elements of every group.
    pub(super) fn keep(&self, [heads, elements]: [usize; 2], kept: &mut [Vec<usize>]) -> f64 {
        let of_head: Vec<f64> = self.values.iter().map(|part| part.errors.iter().sum()).collect();
        let (stay, gone) = ranked(&of_head, heads);
        let mut error = gone.iter().map(|&head| of_head[head]).sum();
        for part in gone.iter().flat_map(|&head| [&self.keys[head], &self.values[head]]) {
            kept[part.group].clear();
        }
        for Part { group, errors } in stay.iter().flat_map(|&head| [&self.keys[head], &self.values[head]]) {
            let (stay, gone) = ranked(errors, elements);
            error += gone.iter().map(|&element| errors[element]).sum::<f64>();
            kept[*group] = stay;
        }
        error
    }
}

/// Returns the places of the largest errors, ascending, and of the others.
pub(super) fn ranked(errors: &[f64], largest: usize) -> (Vec<usize>, Vec<usize>) {
    let mut places: Vec<usize> = (0..errors.len()).collect();
    places.sort_by(|&a, &b| errors[b].total_cmp(&errors[a]));
    let gone = places.split_off(largest.min(places.len()));
    places.sort_unstable();
    (places, gone)
}

/// Returns the errors of the products of queries and keys without each element: those of its queries and of its keys
/// without their variance. Constant keys add the same to all products of a query, which a softmax ignores.
fn products(ties: &Ties, group: usize, measured: Option<Measured<'_>>) -> Vec<f64> {
    let mut errors = vec![0.0; ties.lens[group]];
    for (m, of_matrix) in measured.iter().flat_map(|of| of.constant).enumerate() {
        let (Some(of_rows), (_, layout)) = (of_matrix, &ties.rows[m]) else { continue };
        for rows in ties.ranges(layout, group) {
            errors.iter_mut().zip(&of_rows[rows]).for_each(|(error, of_row)| *error += of_row);
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::moments::collect;
    use crate::methods::distill::removal::in_place;
    use crate::testing::{attention, dataset};

    #[test]
    fn heads_and_elements_that_matter_stay() {
        let mut graph = attention(2, false);
        // Nothing reads head 1 of the values, and elements 2 to 5 of all queries and keys are constant.
        graph.matrices[1].data.iter_mut().enumerate().filter(|(i, _)| i % 32 / 16 == 1).for_each(|(_, w)| *w = 0.0);
        for row in (0..48).filter(|row| (2..6).contains(&(row % 8))) {
            graph.matrices[0].data[3 * row..][..3].fill(0.0);
        }
        let moments = collect(&graph, &dataset(&graph, 4, 60), &mut |_| {});
        let moments: &[&Moments] = &moments.iter().collect::<Vec<_>>();
        let g: &[Vec<f64>] = &graph.matrices.iter().map(|m| vec![1.0; m.rows]).collect::<Vec<_>>();
        let constant = &[Some(in_place(&graph.matrices[0], moments[0], &g[0])), None];
        let ties = Ties::of(&graph);
        let found = HeadUnits::of(&graph, &ties, Some(Measured { moments, g, constant }));
        let [units] = &found[..] else { panic!("{found:?}") };
        assert_eq!((units.sizes(), units.shares(0, &[1.0, 0.5, 0.1])), ([2, 8], vec![2, 1]));
        assert_eq!(units.shares(1, &[1.0, 0.7, 0.5, 0.1]), [8, 4]);
        let mut kept = ties.whole();
        // The values follow three values of the observation, so four of eight say nearly all.
        let errors = [[1, 8], [1, 4], [1, 1]].map(|sizes| units.keep(sizes, &mut kept));
        assert!(errors[0] == 0.0 && errors[1] < 0.05 * errors[2], "{errors:?}");
        units.keep([1, 4], &mut kept);
        assert_eq!(units.keys.iter().map(|part| &kept[part.group][..]).collect::<Vec<_>>(), [&[0, 1, 6, 7][..], &[]]);
        assert_eq!(units.values.iter().map(|part| kept[part.group].len()).collect::<Vec<_>>(), [4, 0]);
    }

    #[test]
    fn rotated_heads_keep_their_elements() {
        let graph = attention(2, true);
        let units = HeadUnits::of(&graph, &Ties::of(&graph), None).remove(0);
        assert_eq!((units.sizes(), units.shares(0, &[0.5]), units.shares(1, &[0.5])), ([2, 8], vec![1], vec![8]));
    }
}
