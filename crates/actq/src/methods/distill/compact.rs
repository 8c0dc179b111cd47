//! Removes elements without bits, and sorts rows by their widths, if neither costs anything at run time.

use nalgebra::{DMatrix, DVector};

use super::dimension::{Dimension, Widths};
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::DAMPING_INPUT;
use crate::graph::narrow::{Narrowed, narrowed};
use crate::graph::ties::Ties;
use crate::graph::{Graph, WeightMatrix};

/// A graph whose hidden vectors hold only the elements with bits.
#[derive(Clone, Debug)]
pub struct Compacted {
    /// The graph.
    pub graph: Graph,
    /// Widths of the matrices' rows in the new order.
    pub widths: Widths,
    /// Former columns of every matrix in the new order.
    pub columns: Vec<Vec<usize>>,
    /// Former rows of every matrix in the new order.
    pub rows: Vec<Vec<usize>>,
}

/// Removes the elements without bits and sorts the others by width. The contribution of a removed element is estimated
/// from the remaining ones by the moments of every matrix's input, and goes into their columns and the biases.
pub fn compact(graph: &Graph, dimensions: &[Dimension], widths: &Widths, moments: &[&Moments]) -> Compacted {
    let ties = Ties::of(graph);
    let mut graph = graph.clone();
    let mut widths = widths.clone();
    let mut kept = ties.whole();
    for dimension in dimensions {
        let order = dimension.order(&widths);
        let of_maker = &mut widths[dimension.maker];
        let gone: Vec<usize> = (0..of_maker.len()).filter(|&r| of_maker[r].is_none()).collect();
        *of_maker = order.iter().map(|&r| of_maker[r]).collect();
        for &consumer in &dimension.consumers {
            let contribution = absorb(&mut graph.matrices[consumer], &gone, &order, moments[consumer]);
            add_to_bias(&mut graph, consumer, &contribution);
        }
        // A dimension is a group of its own.
        kept[ties.rows[dimension.maker].1[0]] = order;
    }
    let Narrowed { graph, rows, columns } = narrowed(&graph, &ties, &kept);
    Compacted { graph, widths, columns, rows }
}

/// Distributes the least-squares estimate of the contribution of the columns `gone` to the columns `kept`. Returns its
/// constant part, which is to be added to the biases. Without correlations, that is the contribution of their means.
pub(super) fn absorb(matrix: &mut WeightMatrix, gone: &[usize], kept: &[usize], moments: &Moments) -> Vec<f32> {
    let centred = moments.centred();
    let damping = (DAMPING_INPUT * centred.trace() / matrix.cols.max(1) as f64).max(1e-30);
    let among = |i: usize, j: usize| centred[(kept[i], kept[j])] + if i == j { damping } else { 0.0 };
    let among = DMatrix::from_fn(kept.len(), kept.len(), among);
    let across = DMatrix::from_fn(kept.len(), gone.len(), |i, j| centred[(kept[i], gone[j])]);
    // [kept, gone]: the share of each kept element in the estimate of a removed one.
    let guess = among.cholesky().map_or_else(|| DMatrix::zeros(kept.len(), gone.len()), |c| c.solve(&across));
    let mean_of =
        |elements: &[usize]| DVector::from_iterator(elements.len(), elements.iter().map(|&c| moments.mean[c]));
    let constant = mean_of(gone) - guess.tr_mul(&mean_of(kept));
    let rows = matrix.data.chunks_exact_mut(matrix.cols);
    rows.map(|row| {
        let lost = DVector::from_iterator(gone.len(), gone.iter().map(|&c| f64::from(row[c])));
        for (&c, change) in kept.iter().zip(&(&guess * &lost)) {
            row[c] = (f64::from(row[c]) + change) as f32;
        }
        lost.dot(&constant) as f32
    })
    .collect()
}

/// Adds values to the biases after a matrix.
pub fn add_to_bias(graph: &mut Graph, matrix: usize, values: &[f32]) {
    for node in &mut graph.nodes {
        for product in node.kind.products().iter().filter(|product| product.matrix == matrix) {
            let bias = &mut node.kind.vectors_mut()[product.bias];
            bias.iter_mut().zip(values).for_each(|(b, v)| *b += v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Evaluator;
    use crate::methods::distill::dimension::{dimensions, testing::graph};
    use actq_kernels::Width;

    /// Makes moments of uncorrelated inputs; those of the second matrix have this mean.
    fn moments(graph: &Graph, hidden: &[f32]) -> Vec<Moments> {
        let of = |(m, matrix): (usize, &WeightMatrix)| {
            let mean: Vec<f64> = (0..matrix.cols).map(|c| if m == 1 { f64::from(hidden[c]) } else { 0.0 }).collect();
            let vector = DVector::from_column_slice(&mean);
            let second = DMatrix::identity(matrix.cols, matrix.cols) + &vector * vector.transpose();
            Moments { second, mean, count: 1 }
        };
        graph.matrices.iter().enumerate().map(of).collect()
    }

    fn compacted(graph: &Graph, widths: &Widths, hidden: &[f32]) -> Compacted {
        let moments = moments(graph, hidden);
        compact(graph, &dimensions(graph), widths, &moments.iter().collect::<Vec<_>>())
    }

    fn have_equal_outputs(a: &Graph, b: &Graph) {
        let [a, b] = [a, b].map(|graph| Evaluator::new(graph).step(&[0.3, -0.7, 1.1], &mut |_, _| {}));
        assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} and {b:?}");
    }

    #[test]
    fn sorting_by_width_changes_nothing() {
        let graph = graph();
        let widths = vec![
            vec![Some(Width::W8), Some(Width::W2), Some(Width::W4), Some(Width::W2), Some(Width::W3)],
            vec![Some(Width::W4); 4],
            vec![Some(Width::W4); 4],
        ];
        let compacted = compacted(&graph, &widths, &[0.0; 5]);
        assert_eq!(compacted.columns[1], [1, 3, 4, 2, 0]);
        assert_eq!(compacted.rows, [vec![1, 3, 4, 2, 0], vec![0, 1, 2, 3], vec![0, 1, 2, 3]]);
        assert!(compacted.widths[0].is_sorted());
        have_equal_outputs(&graph, &compacted.graph);
    }

    #[test]
    fn removal_keeps_the_elements_mean() {
        let graph = graph();
        let mut widths: Widths = graph.matrices.iter().map(|m| vec![Some(Width::W4); m.rows]).collect();
        widths[0][2] = None;
        // At this observation the removed element equals its mean, and no other element correlates with it.
        let mut hidden = Vec::new();
        Evaluator::new(&graph).step(&[0.3, -0.7, 1.1], &mut |m, x| {
            if m == 1 {
                hidden = x.to_vec();
            }
        });
        let compacted = compacted(&graph, &widths, &hidden);
        assert_eq!((compacted.graph.matrices[0].rows, compacted.graph.matrices[1].cols), (4, 4));
        have_equal_outputs(&graph, &compacted.graph);
    }

    #[test]
    fn removed_elements_are_estimated_from_others() {
        // Column 3 is always 2 * column 0 - column 1 + 5.
        let mut random = crate::random::Random::new(5);
        let vectors: Vec<[f64; 4]> = (0..300)
            .map(|_| {
                let x: [f64; 3] = [(); 3].map(|()| f64::from(random.unit()));
                [x[0], x[1], x[2], 2.0 * x[0] - x[1] + 5.0]
            })
            .collect();
        let mean_of = |f: &dyn Fn(&[f64; 4]) -> f64| vectors.iter().map(f).sum::<f64>() / vectors.len() as f64;
        let moments = Moments {
            second: DMatrix::from_fn(4, 4, |i, j| mean_of(&|x| x[i] * x[j])),
            mean: (0..4).map(|i| mean_of(&|x| x[i])).collect(),
            count: vectors.len(),
        };
        let data = vec![0.5, -1.0, 0.25, 0.75, 1.0, 0.0, -0.5, -2.0];
        let mut matrix = WeightMatrix { name: "m".into(), rows: 2, cols: 4, data };
        let bias = absorb(&mut matrix, &[3], &[0, 1, 2], &moments);
        // The damping keeps the guess from being exact.
        let expected = [[2.0, -1.75, 0.25, 3.75], [-3.0, 2.0, -0.5, -10.0]];
        for ((row, bias), expected) in matrix.data.chunks_exact(4).zip(bias).zip(expected) {
            let close = |a: f32, b: f32| assert!((a - b).abs() < 0.1 * b.abs().max(1.0), "{a} and {b}");
            row[..3].iter().zip(expected).for_each(|(a, b)| close(*a, b));
            close(bias, expected[3]);
        }
    }
}
