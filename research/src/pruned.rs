//! A rival: structured pruning with fine-tuning. Elements of hidden vectors are ranked by the Taylor criterion of
//! Molchanov et al. (Importance Estimation for Neural Network Pruning, 2019), `(sum g w)^2` over an element's weights.
//! The elements within the budget continue to learn in f32, and become int8 with a scale per row.
//!
//! The teacher's own answers are the labels, so the gradient of a loss is 0. In its place is that of the outputs, each
//! over its deviation and with a random sign. The mean square is the error of removal to the first order.

use actq::error::Result;
use actq::graph::narrow::narrowed;
use actq::graph::{Derivatives, Network, zero_state};
use actq::random::Random;
use ndarray::Array2;

use crate::student::form::Form;
use crate::student::recipes::Start;
use crate::student::rival::{Rival, Settings, Teacher};
use crate::student::widths::format_widths;

/// Frames, or windows, that the importance is taken over.
const DRAWN: usize = 512;
/// Adam's rates to choose from.
const RATES: [f32; 3] = [1e-3, 3e-4, 3e-3];

/// Makes a pruned network within a budget, in int8. Adam's rate is chosen as for
/// [`student`](crate::student::student).
///
/// # Errors
///
/// [`actq::budget::BudgetTooSmall`] if the fewest elements exceed the budget.
pub fn pruned(teacher: &Teacher<'_>, settings: Settings, progress: &mut dyn FnMut(&str, f64)) -> Result<Rival> {
    let narrowing = teacher.narrowing(Form::Int8, settings.budget)?;
    let importance = importance(teacher, settings.seed);
    let mut ranked: Vec<(usize, usize)> =
        teacher.ties.free.iter().flat_map(|&group| (0..teacher.ties.lens[group]).map(move |e| (group, e))).collect();
    ranked.sort_by(|a, b| importance[b.0][b.1].total_cmp(&importance[a.0][a.1]));
    // The most important elements of every group, so many that a network is left.
    let mut kept = narrowing.least()?;
    for &group in &teacher.ties.free {
        let least = kept[group].len();
        kept[group] = ranked.iter().filter(|(of, _)| *of == group).take(least).map(|(_, e)| *e).collect();
        kept[group].sort_unstable();
    }
    for (group, element) in ranked {
        if let Err(at) = kept[group].binary_search(&element) {
            kept[group].insert(at, element);
            if !narrowing.fits(&kept)? {
                kept[group].remove(at);
            }
        }
    }
    let graph = narrowed(teacher.graph, &teacher.ties, &kept).graph;
    let units = vec![None; graph.matrices.len()];
    let describe = |_: usize| format_widths(&teacher.ties, &kept);
    teacher.learned((&[Start { graph, units }], &RATES), (Form::Int8, settings), &describe, progress)
}

/// Returns the importance of each element of each group.
fn importance(teacher: &Teacher<'_>, seed: u64) -> Vec<Vec<f64>> {
    let (graph, ties, windows) = (teacher.graph, &teacher.ties, &teacher.windows);
    let network = Network::new(graph);
    let mut random = Random::new(seed);
    let mut importance: Vec<Vec<f64>> = ties.lens.iter().map(|&len| vec![0.0; len]).collect();
    for _ in 0..(DRAWN / windows.window).max(1) {
        let batch = windows.batch(1, None, &mut random);
        let pass = network.forward(&windows.weights, batch.frames, &mut batch.state.clone());
        let deviations: Vec<f32> = windows.output_variance.iter().map(|variance| variance.sqrt()).collect();
        let sign = |(_, output): (usize, usize)| match deviations[output] {
            deviation if deviation > 0.0 => random.sign() / deviation,
            _ => 0.0,
        };
        let d = Array2::from_shape_fn(pass.output().raw_dim(), sign);
        let derivatives = network.backward(&windows.weights, pass, d, &mut zero_state(graph, 1));
        let (matrices, vectors) = Derivatives::sum(graph, vec![derivatives]);
        let mut sums: Vec<Vec<f64>> = ties.lens.iter().map(|&len| vec![0.0; len]).collect();
        for (n, node) in graph.nodes.iter().enumerate() {
            for product in node.kind.products() {
                let (_, layout) = &ties.rows[product.matrix];
                let elements: Vec<(usize, usize)> =
                    layout.iter().flat_map(|&group| (0..ties.lens[group]).map(move |e| (group, e))).collect();
                let (matrix, grads) = (&graph.matrices[product.matrix], &matrices[product.matrix]);
                for (r, (w, g)) in matrix.data.chunks_exact(matrix.cols).zip(grads.rows()).enumerate() {
                    let (group, element) = elements[r % elements.len()];
                    let of_bias = node.kind.vectors()[product.bias][r] * vectors[n][product.bias][r];
                    let of_row: f32 = w.iter().zip(g).map(|(w, g)| w * g).sum();
                    sums[group][element] += f64::from(of_row + of_bias);
                }
            }
        }
        for (total, sums) in importance.iter_mut().zip(sums) {
            total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum * sum);
        }
    }
    importance
}

#[cfg(test)]
mod tests {
    use actq::policy::Policy;

    use super::*;
    use crate::student::tests::{settings, wide};
    use crate::testing::dataset;

    #[test]
    fn pruning_keeps_shapes_and_bytes() {
        const BYTES: usize = 1200;
        let policy = Policy::of("wide", wide());
        let recording = dataset(&policy.graph, 4, 100);
        let teacher = Teacher::new(&policy, &policy.graph, &recording);
        let rival = pruned(&teacher, settings(BYTES, 200), &mut |_, _| {}).expect("a network");
        let shapes: Vec<(usize, usize)> = rival.network.matrices.iter().map(|m| (m.rows, m.cols)).collect();
        assert_eq!((shapes[0].1, shapes[2].0), (4, 2));
        assert_eq!((shapes[0].0, shapes[1].0), (shapes[1].1, shapes[2].1));
        assert!(shapes[0].0 < 24 && shapes[1].0 < 20, "{shapes:?}");
        let image = rival.image.expect("an image").image;
        assert!(image.len() <= BYTES && image.len() > BYTES * 9 / 10, "{}", image.len());
    }

    #[test]
    fn elements_without_effect_matter_least() {
        let mut graph = wide();
        // The columns of the last matrix that read element 3.
        for row in graph.matrices[2].data.chunks_exact_mut(20) {
            row[3] = 0.0;
        }
        let policy = Policy::of("wide", graph);
        let recording = dataset(&policy.graph, 4, 100);
        let teacher = Teacher::new(&policy, &policy.graph, &recording);
        let importance = importance(&teacher, 1);
        let of_last = &importance[teacher.ties.free[1]];
        assert_eq!(of_last[3], 0.0);
        assert!(of_last.iter().enumerate().all(|(e, i)| e == 3 || *i > 0.0), "{of_last:?}");
    }
}
