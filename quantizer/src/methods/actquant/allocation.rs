//! Stage 1 of ActQuant, second half: a width for every matrix from the scores.

use actq_kernels::image::block_bytes;
use actq_kernels::layout::Width;
use anyhow::{Result, ensure};

use crate::budget::BudgetTooSmall;
use crate::graph::{Graph, WeightMatrix};
use crate::methods::options::Packing;

/// Bytes of a matrix at one width: codes, padding, scales and the block record.
fn bytes(matrix: &WeightMatrix, width: Width, packing: Packing) -> usize {
    block_bytes(packing.shape(width, matrix.rows, matrix.cols), false)
}

/// The error that a matrix of this score is taken to make with codes of so many bits: `score * 2^(-2 bits)`.
fn noise(score: f64, bits: u32) -> f64 {
    score * (-2.0 * f64::from(bits)).exp2()
}

/// The layer of every matrix: the node that uses it first, so that both matrices of an LSTM or GRU are one layer.
pub fn layers(graph: &Graph) -> Vec<usize> {
    let mut layers = vec![usize::MAX; graph.matrices.len()];
    for (layer, node) in graph.nodes.iter().enumerate() {
        for product in node.kind.products() {
            layers[product.matrix] = layers[product.matrix].min(layer);
        }
    }
    layers
}

/// A width per matrix within `limit` bytes: see [`spend`].
///
/// # Errors
///
/// [`BudgetTooSmall`] if the narrowest widths take more.
pub fn allocate(graph: &Graph, scores: &[f64], packing: Packing, limit: f64) -> Result<Vec<Width>> {
    let size = |m: usize, choice: usize| bytes(&graph.matrices[m], Width::ALL[choice], packing);
    let chosen = spend(graph, scores, &Width::ALL.map(Width::bits), size, limit)?;
    Ok(chosen.into_iter().map(|choice| Width::ALL[choice]).collect())
}

/// A format per matrix that keeps the sum over layers of `E_l^2` low, `E_l` being the sum over the layer's matrices of
/// `score * 2^(-2 bits)`, within `limit` bytes. The formats have codes of `bits` bits, from few to many; `size` gives the bytes of a
/// matrix in one of them.
///
/// Greedy, as in the paper: from the narrowest format on, always the upgrade with the largest fall of `E_l^2` per byte among
/// those that fit. Among equals the narrowest matrix goes first, so that what the scores leave over is spread.
///
/// # Errors
///
/// [`BudgetTooSmall`] if the narrowest formats take more.
pub fn spend(
    graph: &Graph,
    scores: &[f64],
    bits: &[u32],
    size: impl Fn(usize, usize) -> usize,
    limit: f64,
) -> Result<Vec<usize>> {
    let layers = layers(graph);
    let mut chosen = vec![0; graph.matrices.len()];
    let mut used: usize = (0..chosen.len()).map(|m| size(m, 0)).sum();
    ensure!(used as f64 <= limit, BudgetTooSmall { bytes: used, limit, weights: graph.weights() });
    loop {
        let layer_error = |layer: usize| -> f64 {
            (0..chosen.len()).filter(|&m| layers[m] == layer).map(|m| noise(scores[m], bits[chosen[m]])).sum()
        };
        let upgrade = |m: usize| {
            let (now, next) = (bits[chosen[m]], *bits.get(chosen[m] + 1)?);
            let more = size(m, chosen[m] + 1) - size(m, chosen[m]);
            let before = layer_error(layers[m]);
            let after = before - noise(scores[m], now) + noise(scores[m], next);
            let gain = (before * before - after * after) / more as f64;
            ((used + more) as f64 <= limit).then_some((m, more, gain))
        };
        let better = |a: &(usize, usize, f64), b: &(usize, usize, f64)| {
            a.2.total_cmp(&b.2).then(chosen[b.0].cmp(&chosen[a.0])).then(b.0.cmp(&a.0))
        };
        let Some((m, more, _)) = (0..chosen.len()).filter_map(upgrade).max_by(better) else { break };
        chosen[m] += 1;
        used += more;
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use actq_kernels::layout::Lanes;

    const PACKING: Packing = Packing { lanes: Lanes::Paired, group: 32 };
    use crate::graph::ops::Linear;
    use crate::methods::actquant::testing::lstm;

    /// A chain of square matrices, each a layer of its own.
    fn chain(count: usize) -> Graph {
        let mut graph = Graph::new(64);
        for matrix in 0..count {
            graph.matrices.push(WeightMatrix {
                name: format!("w{matrix}"),
                rows: 64,
                cols: 64,
                data: vec![0.0; 64 * 64],
            });
            graph.add(Linear { matrix, bias: vec![0.0; 64] }, &[matrix]).expect("it fits");
        }
        graph
    }

    fn total(graph: &Graph, widths: &[Width]) -> usize {
        graph.matrices.iter().zip(widths).map(|(m, w)| bytes(m, *w, PACKING)).sum()
    }

    /// For separate layers of equal size the objective is a sum of functions of the bytes that fall ever more slowly, where
    /// greedy gives the best of all assignments with at most the bytes that it used.
    #[test]
    fn greedy_is_the_best_for_separate_layers_of_equal_size() {
        let graph = chain(4);
        let error = |scores: &[f64], widths: &[Width]| -> f64 {
            scores.iter().zip(widths).map(|(s, w)| noise(*s, w.bits()).powi(2)).sum()
        };
        for scores in [[1.0, 0.5, 0.25, 0.1], [3.0, 3.0, 1e-3, 0.0], [1.0, 1.1, 1.2, 40.0]] {
            for bpw in [2.6, 2.9, 3.1, 3.4, 3.9, 5.0, 9.0] {
                let limit = bpw * graph.weights() as f64 / 8.0;
                let greedy = allocate(&graph, &scores, PACKING, limit).expect("fits");
                let used = total(&graph, &greedy);
                assert!(used as f64 <= limit);
                let best = (0..256usize)
                    .map(|code| [0, 2, 4, 6].map(|shift| Width::ALL[code >> shift & 3]))
                    .filter(|widths| total(&graph, widths) <= used)
                    .map(|widths| error(&scores, &widths))
                    .fold(f64::MAX, f64::min);
                let found = error(&scores, &greedy);
                assert!(found <= best * (1.0 + 1e-12), "{scores:?} at {bpw}: {found:e} against {best:e}");
            }
        }
    }

    #[test]
    fn a_budget_below_two_bits_is_refused_and_zero_scores_still_use_the_rest() {
        let graph = chain(3);
        let error = allocate(&graph, &[1.0; 3], PACKING, 2.0 * graph.weights() as f64 / 8.0).expect_err("too small");
        assert!(error.downcast_ref::<BudgetTooSmall>().is_some());
        let widths = allocate(&graph, &[0.0; 3], PACKING, 1e9).expect("fits");
        assert_eq!(widths, [Width::W8; 3]);
        let spread = allocate(&graph, &[0.0; 3], PACKING, 3.6 * graph.weights() as f64 / 8.0).expect("fits");
        assert_eq!(spread, [Width::W3; 3]);
    }

    #[test]
    fn both_matrices_of_a_cell_are_one_layer() {
        assert_eq!(layers(&lstm()), [0, 0, 1]);
    }
}
