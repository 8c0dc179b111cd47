//! Networks that keep some elements of each hidden vector.

use super::ops::Span;
use super::ties::Ties;
use super::{Graph, NodeKind, WeightMatrix};

/// A network of some elements.
#[derive(Clone, Debug)]
pub struct Narrowed {
    /// The network, with the weights that the elements had.
    pub graph: Graph,
    /// Former rows of every matrix.
    pub rows: Vec<Vec<usize>>,
    /// Former columns of every matrix.
    pub columns: Vec<Vec<usize>>,
}

/// Keeps these elements of each group of `ties`, in their order: at least one of every vector.
pub fn narrowed(graph: &Graph, ties: &Ties, kept: &[Vec<usize>]) -> Narrowed {
    let matrices = || 0..graph.matrices.len();
    let rows: Vec<Vec<usize>> = matrices().map(|m| ties.row_places(m, kept)).collect();
    let columns: Vec<Vec<usize>> = matrices().map(|m| ties.places(&ties.cols[m], kept)).collect();
    let mut graph = graph.clone();
    for (matrix, (rows, columns)) in graph.matrices.iter_mut().zip(rows.iter().zip(&columns)) {
        *matrix = part(matrix, rows, columns);
    }
    for (n, node) in graph.nodes.iter_mut().enumerate() {
        if let NodeKind::Concat(concat) = &mut node.kind {
            for (span, &input) in concat.0.iter_mut().zip(&node.inputs) {
                let of_input = ties.places(&ties.values[input], kept);
                let before = |end: usize| of_input.iter().filter(|place| **place < end).count();
                let from = before(span.from);
                *span = Span { from, len: before(span.from + span.len) - from };
            }
        }
        let places = ties.places(&ties.values[n + 1], kept);
        node.kind.keep_units(node.len, &places);
        node.len = places.len();
    }
    Narrowed { graph, rows, columns }
}

/// Returns these rows and columns of a matrix.
pub(super) fn part(matrix: &WeightMatrix, rows: &[usize], columns: &[usize]) -> WeightMatrix {
    let data = rows.iter().flat_map(|r| columns.iter().map(move |c| matrix.data[r * matrix.cols + c])).collect();
    WeightMatrix { name: matrix.name.clone(), rows: rows.len(), cols: columns.len(), data }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::ops::Linear;
    use crate::graph::ties::Heads;
    use crate::testing::{attention, branches, gru, lstm, mlp, outputs, residual, transformer};

    #[test]
    fn all_elements_make_the_same_network() {
        for graph in [mlp(), lstm(), residual(4, true), branches([4, 3]), transformer(0), attention(2, true)] {
            let ties = Ties::of(&graph);
            assert_eq!(outputs(&graph), outputs(&narrowed(&graph, &ties, &ties.whole()).graph));
        }
    }

    #[test]
    fn elements_that_nothing_reads_go_without_a_trace() {
        for mut graph in [mlp(), lstm(), gru(4), residual(4, false), branches([4, 3])] {
            let ties = Ties::of(&graph);
            let mut kept = ties.whole();
            for &group in &ties.free {
                kept[group].remove(1);
            }
            for (m, matrix) in graph.matrices.iter_mut().enumerate() {
                let read = ties.places(&ties.cols[m], &kept);
                let WeightMatrix { cols, data, .. } = matrix;
                let gone: Vec<usize> = (0..*cols).filter(|c| !read.contains(c)).collect();
                data.chunks_mut(*cols).for_each(|row| gone.iter().for_each(|&c| row[c] = 0.0));
            }
            let narrow = narrowed(&graph, &ties, &kept).graph;
            assert!(narrow.weights() < graph.weights());
            for (a, b) in outputs(&graph).iter().flatten().zip(outputs(&narrow).iter().flatten()) {
                assert!((a - b).abs() < 1e-6, "{a} and {b}");
            }
        }
    }

    #[test]
    fn removed_elements_leave_no_weights() {
        let graph = lstm();
        let ties = Ties::of(&graph);
        let mut kept = ties.whole();
        kept[ties.free[0]] = vec![0, 2];
        let narrow = narrowed(&graph, &ties, &kept).graph;
        let shapes: Vec<(usize, usize)> = narrow.matrices.iter().map(|m| (m.rows, m.cols)).collect();
        assert_eq!(shapes, [(8, 2), (8, 2), (2, 2)]);
        assert_eq!(narrow.matrices[2].data[1], graph.matrices[2].data[2]);
        assert_eq!(narrow.state_len(), 4);
    }

    #[test]
    fn heads_and_elements_that_add_nothing_go_without_a_trace() {
        for (kv_heads, is_rotated) in [(4, false), (2, false), (2, true)] {
            let mut graph = attention(kv_heads, is_rotated);
            let ties = Ties::of(&graph);
            let mut kept = ties.whole();
            let Heads { keys, values } = &ties.heads[0];
            [keys[1], values[1]].into_iter().for_each(|group| kept[group].clear());
            // Every head loses two other elements.
            for (head, group) in values.iter().chain(keys).enumerate().filter(|(_, group)| ties.lens[**group] == 8) {
                kept[*group].retain(|element| is_rotated || element / 2 != head % 4);
            }
            let read = ties.places(&ties.cols[1], &kept);
            let WeightMatrix { cols, data, .. } = &mut graph.matrices[1];
            data.iter_mut().enumerate().filter(|(i, _)| !read.contains(&(i % *cols))).for_each(|(_, w)| *w = 0.0);
            let made = ties.row_places(0, &kept);
            let queries: Vec<usize> = (0..32).filter(|row| !made.contains(row)).collect();
            for node in &mut graph.nodes {
                if let NodeKind::Linear(Linear { matrix: 0, bias }) = &mut node.kind {
                    queries.iter().for_each(|&row| bias[row] = 0.0);
                }
            }
            queries.iter().for_each(|&row| graph.matrices[0].data[3 * row..][..3].fill(0.0));
            let narrow = narrowed(&graph, &ties, &kept).graph;
            let attention = narrow.nodes.iter().find_map(|node| match node.kind {
                NodeKind::Attention(attention) => Some([attention.heads, attention.kv_heads, attention.dim]),
                _ => None,
            });
            assert_eq!(attention, Some([4 - 4 / kv_heads, kv_heads - 1, if is_rotated { 8 } else { 6 }]));
            for (a, b) in outputs(&graph).iter().flatten().zip(outputs(&narrow).iter().flatten()) {
                assert!((a - b).abs() < 1e-6, "{a} and {b}");
            }
        }
    }
}
