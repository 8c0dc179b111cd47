//! Networks that keep some elements of each hidden vector.

use actq::error::Result;
use actq::graph::ops::Span;
use actq::graph::{Graph, NodeKind, WeightMatrix};

use super::ties::Ties;

/// Returns the network of the kept elements, with the weights that they had; `kept` has those of each group, ascending.
///
/// # Errors
///
/// If nothing of a vector is kept.
pub fn cut(graph: &Graph, ties: &Ties, kept: &[Vec<usize>]) -> Result<Graph> {
    let mut narrow = Graph::new(graph.obs_len);
    for (m, matrix) in graph.matrices.iter().enumerate() {
        let (rows, cols) = (ties.row_places(m, kept), ties.places(&ties.cols[m], kept));
        let data = rows.iter().flat_map(|r| cols.iter().map(move |c| matrix.data[r * matrix.cols + c])).collect();
        let name = matrix.name.clone();
        narrow.add_matrix(WeightMatrix { name, rows: rows.len(), cols: cols.len(), data })?;
    }
    for (n, node) in graph.nodes.iter().enumerate() {
        let places = ties.places(&ties.values[n + 1], kept);
        let mut kind = node.kind.clone();
        match &mut kind {
            NodeKind::Linear(linear) => linear.bias = picked(&linear.bias, &ties.row_places(linear.matrix, kept)),
            NodeKind::Lstm(lstm) => {
                lstm.bias = picked(&lstm.bias, &ties.row_places(lstm.input, kept));
                lstm.hidden = places.len();
            }
            NodeKind::Gru(gru) => {
                gru.input_bias = picked(&gru.input_bias, &ties.row_places(gru.input, kept));
                gru.state_bias = picked(&gru.state_bias, &ties.row_places(gru.state, kept));
                gru.hidden = places.len();
            }
            NodeKind::LayerNorm(norm) => {
                norm.weight = picked(&norm.weight, &places);
                norm.bias = picked(&norm.bias, &places);
            }
            NodeKind::RmsNorm(norm) => norm.weight = picked(&norm.weight, &places),
            NodeKind::Normalize(normalize) => {
                normalize.mean = picked(&normalize.mean, &places);
                normalize.scale = picked(&normalize.scale, &places);
            }
            NodeKind::Concat(concat) => {
                for (span, &input) in concat.0.iter_mut().zip(&node.inputs) {
                    let of_input = ties.places(&ties.values[input], kept);
                    let before = |end: usize| of_input.partition_point(|place| *place < end);
                    let from = before(span.from);
                    *span = Span { from, len: before(span.from + span.len) - from };
                }
            }
            NodeKind::Table(table) => {
                table.rows = table.rows.chunks_exact(table.len).flat_map(|row| picked(row, &places)).collect();
                table.len = places.len();
            }
            NodeKind::Balance(_)
            | NodeKind::Add(_)
            | NodeKind::Mul(_)
            | NodeKind::Iterate(_)
            | NodeKind::Pointwise(_) => {}
        }
        narrow.add(kind, &node.inputs)?;
    }
    narrow.denoising = graph.denoising.clone();
    Ok(narrow)
}

fn picked(values: &[f32], places: &[usize]) -> Vec<f32> {
    places.iter().map(|&place| values[place]).collect()
}

#[cfg(test)]
mod tests {
    use actq::graph::Evaluator;

    use super::*;
    use crate::testing::{lstm, mlp};

    #[test]
    fn all_elements_make_the_same_network() {
        for graph in [mlp(), lstm()] {
            let ties = Ties::of(&graph);
            let same = cut(&graph, &ties, &ties.whole()).expect("a network");
            let act = |graph: &Graph| {
                let mut evaluator = Evaluator::new(graph);
                let obs = vec![0.3; graph.obs_len];
                [(); 2].map(|()| evaluator.step(&obs, &mut |_, _| {}))
            };
            assert_eq!(act(&graph), act(&same));
        }
    }

    #[test]
    fn removed_elements_leave_no_weights() {
        let graph = lstm();
        let ties = Ties::of(&graph);
        let mut kept = ties.whole();
        kept[ties.free[0]] = vec![0, 2];
        let narrow = cut(&graph, &ties, &kept).expect("a network");
        let shapes: Vec<(usize, usize)> = narrow.matrices.iter().map(|m| (m.rows, m.cols)).collect();
        assert_eq!(shapes, [(8, 2), (8, 2), (2, 2)]);
        assert_eq!(narrow.matrices[2].data[1], graph.matrices[2].data[2]);
        assert_eq!(narrow.state_len(), 4);
    }
}
