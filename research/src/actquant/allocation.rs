//! Stage 1 of ActQuant, second half: a width for every matrix by its score.

use std::ops::Range;

use actq::budget::BudgetTooSmall;
use actq::error::Result;
use actq::graph::{Graph, WeightMatrix};
use actq::methods::Packing;
use actq_kernels::image::block_bytes;
use actq_kernels::layout::Width;

use super::choices::{Choices, NoiseBits};

/// Returns the bytes of a matrix at one width: codes, padding, scales and the block record.
fn bytes(matrix: &WeightMatrix, width: Width, packing: Packing) -> usize {
    block_bytes(packing.shape(width, matrix.rows, matrix.cols), false)
}

/// Returns the assumed error of a matrix of this score at this many bits: `score * 2^(-2 bits)`.
fn noise(score: f64, bits: f64) -> f64 {
    score * (-2.0 * bits).exp2()
}

/// Returns the layer of every matrix: the node that first uses it. Both matrices of an LSTM or GRU are one layer.
fn layers(graph: &Graph) -> Vec<usize> {
    let mut layers = vec![usize::MAX; graph.matrices.len()];
    for (layer, node) in graph.nodes.iter().enumerate() {
        for product in node.kind.products() {
            layers[product.matrix] = layers[product.matrix].min(layer);
        }
    }
    layers
}

/// Returns for each matrix whether the action comes from it without another matrix between.
fn heads(graph: &Graph) -> Vec<bool> {
    let mut heads = vec![false; graph.matrices.len()];
    let mut reaches = vec![false; graph.nodes.len() + 1];
    reaches[graph.output()] = true;
    for (n, node) in graph.nodes.iter().enumerate().rev() {
        if !reaches[n + 1] {
            continue;
        }
        let products = node.kind.products();
        if products.is_empty() {
            node.inputs.iter().for_each(|&value| reaches[value] = true);
        }
        products.iter().for_each(|product| heads[product.matrix] = true);
    }
    heads
}

/// Returns the permitted widths of every matrix, as indices in [`Width::ALL`].
fn allowed(graph: &Graph, choices: &Choices) -> Vec<Range<usize>> {
    let up_to = |width: Width| Width::ALL.iter().position(|w| *w == width).map_or(0, |choice| choice + 1);
    let of_matrix = |head: bool| match choices.head {
        Some(width) if head => up_to(width) - 1..up_to(width),
        _ => 0..up_to(choices.widest),
    };
    heads(graph).into_iter().map(of_matrix).collect()
}

/// Returns the fewest bytes that the matrices of `graph` take: those of the narrowest widths.
pub fn least_bytes(graph: &Graph, choices: &Choices, packing: Packing) -> usize {
    let allowed = allowed(graph, choices);
    graph.matrices.iter().zip(allowed).map(|(m, allowed)| bytes(m, Width::ALL[allowed.start], packing)).sum()
}

/// Allocates a width per matrix within `limit` bytes: see [`spend`].
///
/// # Errors
///
/// [`BudgetTooSmall`] if the narrowest widths take more.
pub fn allocate(graph: &Graph, scores: &[f64], choices: &Choices, packing: Packing, limit: f64) -> Result<Vec<Width>> {
    let size = |m: usize, choice: usize| bytes(&graph.matrices[m], Width::ALL[choice], packing);
    let bits = |m: usize, choice: usize| match choices.noise {
        NoiseBits::Codes => f64::from(Width::ALL[choice].bits()),
        NoiseBits::Format => 8.0 * size(m, choice) as f64 / graph.matrices[m].data.len() as f64,
    };
    let chosen = spend(graph, scores, &allowed(graph, choices), bits, size, limit)?;
    Ok(chosen.into_iter().map(|choice| Width::ALL[choice]).collect())
}

/// Allocates a format per matrix within `limit` bytes, such that the sum over layers of `E_l^2` is low. `E_l` is the
/// sum over the layer's matrices of `score * 2^(-2 bits)`. Formats are numbered from few bits to many. `allowed` holds
/// the permitted ones of each matrix, `bits` returns the bits of a matrix in one of them, and `size` its bytes.
///
/// The allocation is greedy, as in the paper. From the narrowest format on, it repeatedly makes the upgrade with the
/// largest fall of `E_l^2` per byte among those that fit. Among equals the narrowest matrix goes first, so that bytes
/// which the scores do not claim are spread.
///
/// # Errors
///
/// [`BudgetTooSmall`] if the narrowest formats take more.
pub fn spend(
    graph: &Graph,
    scores: &[f64],
    allowed: &[Range<usize>],
    bits: impl Fn(usize, usize) -> f64,
    size: impl Fn(usize, usize) -> usize,
    limit: f64,
) -> Result<Vec<usize>> {
    let layers = layers(graph);
    let mut chosen: Vec<usize> = allowed.iter().map(|choices| choices.start).collect();
    let mut used: usize = chosen.iter().enumerate().map(|(m, &choice)| size(m, choice)).sum();
    BudgetTooSmall::check(used, limit, graph.weights())?;
    loop {
        let layer_error = |layer: usize| -> f64 {
            (0..chosen.len()).filter(|&m| layers[m] == layer).map(|m| noise(scores[m], bits(m, chosen[m]))).sum()
        };
        let upgrade = |m: usize| {
            if chosen[m] + 1 >= allowed[m].end {
                return None;
            }
            let (now, next) = (bits(m, chosen[m]), bits(m, chosen[m] + 1));
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
    use actq::graph::ops::Linear;
    use actq_kernels::layout::Lanes;

    use super::*;
    use crate::testing::lstm;

    const PACKING: Packing = Packing { x_max: Lanes::PAIRED_X_MAX, group: 32 };

    /// Makes a chain of square matrices, each a layer of its own.
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

    /// Checks that greedy gives the best of all assignments with at most the bytes that it used. For separate layers of
    /// equal size, the objective is a sum of convex functions of the bytes.
    #[test]
    fn greedy_is_optimal_for_equal_separate_layers() {
        let graph = chain(4);
        let error = |scores: &[f64], widths: &[Width]| -> f64 {
            scores.iter().zip(widths).map(|(s, w)| noise(*s, f64::from(w.bits())).powi(2)).sum()
        };
        for scores in [[1.0, 0.5, 0.25, 0.1], [3.0, 3.0, 1e-3, 0.0], [1.0, 1.1, 1.2, 40.0]] {
            for bpw in [2.6, 2.9, 3.1, 3.4, 3.9, 5.0, 9.0] {
                let limit = bpw * graph.weights() as f64 / 8.0;
                let greedy = allocate(&graph, &scores, &Choices::default(), PACKING, limit).expect("fits");
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
    fn tiny_budgets_are_refused_and_zero_scores_spend() {
        let graph = chain(3);
        let error = allocate(&graph, &[1.0; 3], &Choices::default(), PACKING, 2.0 * graph.weights() as f64 / 8.0)
            .expect_err("too small");
        assert!(error.budget().is_some());
        let widths = allocate(&graph, &[0.0; 3], &Choices::default(), PACKING, 1e9).expect("fits");
        assert_eq!(widths, [Width::W8; 3]);
        let spread = allocate(&graph, &[0.0; 3], &Choices::default(), PACKING, 3.6 * graph.weights() as f64 / 8.0)
            .expect("fits");
        assert_eq!(spread, [Width::W3; 3]);
    }

    #[test]
    fn widest_codes_and_head_width_are_kept() {
        let graph = chain(3);
        let widths = |choices: &Choices, bpw: f64| {
            allocate(&graph, &[0.0, 3.0, 1.0], choices, PACKING, bpw * graph.weights() as f64 / 8.0).expect("fits")
        };
        let plain = Choices::default();
        assert_eq!(widths(&Choices { widest: Width::W4, ..plain }, 100.0), [Width::W4; 3]);
        assert_eq!(widths(&Choices { head: Some(Width::W3), ..plain }, 100.0), [Width::W8, Width::W8, Width::W3]);
        // The head's bits count, and it keeps them although others would gain more.
        let head = Choices { head: Some(Width::W8), ..plain };
        let least = total(&graph, &[Width::W2, Width::W2, Width::W8]);
        let limit = least as f64 - 0.5;
        let error = allocate(&graph, &[1.0; 3], &head, PACKING, limit).expect_err("too small");
        assert!(error.budget().is_some_and(|small| small.bytes == least), "{error}");
        assert_eq!(widths(&head, 8.0 * least as f64 / graph.weights() as f64), [Width::W2, Width::W2, Width::W8]);
        assert_eq!(heads(&lstm()), [false, false, true]);
    }

    #[test]
    fn format_noise_counts_scales() {
        // One matrix has many short rows, whose scales and padding take more bits than those of the long rows of the
        // other.
        let mut graph = Graph::new(8);
        for (matrix, (rows, cols)) in [(64, 8), (8, 64)].into_iter().enumerate() {
            graph.matrices.push(WeightMatrix { name: format!("w{matrix}"), rows, cols, data: vec![0.0; 512] });
            graph.add(Linear { matrix, bias: vec![0.0; rows] }, &[matrix]).expect("it fits");
        }
        let of = |noise, score| {
            let choices = Choices { noise, ..Choices::default() };
            let narrow = total(&graph, &[Width::W2; 2]);
            let step = |m: usize| {
                bytes(&graph.matrices[m], Width::W3, PACKING) - bytes(&graph.matrices[m], Width::W2, PACKING)
            };
            let limit = (narrow + step(0).max(step(1))) as f64;
            allocate(&graph, &[score, 1.0], &choices, PACKING, limit).expect("fits")
        };
        // A matrix with more bits is assumed to have less error, so it needs a larger score for the upgrade.
        let first = |widths: Vec<Width>| widths[0] > Width::W2;
        let needed = |noise| (0..400).map(|i| 1.05f64.powi(i - 20)).find(|&score| first(of(noise, score)));
        let (codes, format) = (needed(NoiseBits::Codes).expect("a score"), needed(NoiseBits::Format).expect("a score"));
        assert!(format > 2.0 * codes, "{codes} and {format}");
    }

    #[test]
    fn both_matrices_of_a_cell_are_one_layer() {
        assert_eq!(layers(&lstm()), [0, 0, 1]);
    }
}
