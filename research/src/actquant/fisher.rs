//! Stage 2 of ActQuant: the importance of every weight, by the Fisher information of the action loss.

use std::borrow::Cow;

use actq::data::Dataset;
use actq::error::{Context, Result};
use actq::graph::{Factors, Graph, Network, Pass, Weights, start_state, zero_state};
use ndarray::{Array2, Array3, Axis, Zip, linalg::general_mat_mul, s};

use super::loss::{ActionLoss, Signs};

/// Steps that the gradient of a recurrent network runs back.
const WINDOW: usize = 16;

/// Selection of the gradients of the Fisher information.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Approximate most frames whose gradient is taken, evenly spaced.
    pub samples: usize,
    /// Frames whose gradients are averaged before they are squared, at least 1: 1 for the Fisher information, more for
    /// the batches of a training loop. The frames are successive; for a recurrent network they are as many episodes at
    /// the same step.
    pub batch: usize,
    /// Signs if the recorded actions are the network's own.
    pub signs: Signs,
    /// Share of L1 in the loss, 0 to 1; the rest is the likelihood of the action.
    pub alpha: f64,
}

/// Returns the mean over frames (or batches) of `(dL/dw)^2` for every weight, as `[rows, cols]` per matrix: the
/// action-mixed Fisher information of ActQuant (arXiv 2605.24011). `L` is `ActionLoss`; at alpha = 1 it is
/// `sum over d of |y_d - t_d|`, without a likelihood.
///
/// Recorded actions are mostly the policy's own, where L1 has its kink: [`Signs`].
///
/// A recurrent network's gradient is truncated. Episodes run from their starting state and are cut into windows of 16
/// steps. Each window's last frame is one sample, whose gradient runs back to the start of the window. Shorter rests
/// are not used. Everything else is exact: contributions of several steps or uses are summed before they are squared.
///
/// `progress` receives the share done.
pub fn importance(
    graph: &Graph,
    dataset: &Dataset,
    sampling: Sampling,
    progress: &mut dyn FnMut(f64),
) -> Result<Vec<Array2<f32>>> {
    let weights = Weights::of(graph);
    let network = Network::new(graph);
    let recurrent = graph.state_len() > 0;
    let dataset = &if sampling.batch > 1 && !recurrent {
        Cow::Owned(side_by_side(dataset, sampling.batch))
    } else {
        Cow::Borrowed(dataset)
    };
    let longest = dataset.length.iter().copied().max().unwrap_or(0);
    let window = if recurrent { WINDOW.min(longest) } else { 1 };
    let every = (dataset.frames() / window.max(1)).div_ceil(sampling.samples.max(1)).max(1);
    let mut loss = ActionLoss::new(dataset, sampling.alpha, sampling.signs).context("array \"action\" is missing")?;

    let mut alive: Vec<usize> = (0..dataset.length.len()).collect();
    let starts: Vec<_> = alive.iter().map(|&episode| dataset.start(episode)).collect();
    let mut state = start_state(graph, &starts);
    let mut fisher: Vec<Array2<f32>> = graph.matrices.iter().map(|m| Array2::zeros((m.rows, m.cols))).collect();
    let mut batches = 0;
    for (index, start) in (0..longest).step_by(window.max(1)).enumerate() {
        let staying: Vec<usize> = (0..alive.len()).filter(|&i| dataset.length[alive[i]] >= start + window).collect();
        if staying.is_empty() {
            break;
        }
        alive = staying.iter().map(|&i| alive[i]).collect();
        for array in state.iter_mut().flatten() {
            *array = array.select(Axis(0), &staying);
        }
        let passes: Vec<Pass> = (start..start + window)
            .map(|step| network.forward(&weights, rows(&dataset.obs, &alive, step), &mut state))
            .collect();
        if index % every == 0 {
            let output = passes[passes.len() - 1].output();
            let recorded =
                rows(dataset.action.as_ref().context("array \"action\" is missing")?, &alive, start + window - 1);
            let d_output =
                Array2::from_shape_fn(output.raw_dim(), |at| loss.derivative(at.1, output[at] - recorded[at]));
            add_squares(&network, &weights, passes, (d_output, sampling.batch), &mut fisher);
            batches += alive.len().div_ceil(sampling.batch);
        }
        progress((start + window) as f64 / longest as f64);
    }
    for matrix in &mut fisher {
        *matrix /= batches.max(1) as f32;
    }
    Ok(fisher)
}

/// Returns the frames of all episodes, `count` successive ones at every step.
fn side_by_side(dataset: &Dataset, count: usize) -> Dataset {
    let frames: Vec<(usize, usize)> = dataset
        .length
        .iter()
        .enumerate()
        .flat_map(|(episode, &steps)| (0..steps).map(move |step| (episode, step)))
        .collect();
    let steps = frames.len().div_ceil(count);
    let rearranged = |array: &Array3<f32>| {
        let mut to = Array3::zeros((count, steps, array.dim().2));
        for (i, &(episode, step)) in frames.iter().enumerate() {
            to.slice_mut(s![i % count, i / count, ..]).assign(&array.slice(s![episode, step, ..]));
        }
        to
    };
    Dataset {
        path: dataset.path.clone(),
        obs: rearranged(&dataset.obs),
        action: dataset.action.as_ref().map(rearranged),
        length: (0..count).map(|i| (frames.len() - i.min(frames.len())).div_ceil(count)).collect(),
        state: None,
    }
}

/// Runs back from the last of `passes`, and adds to `fisher` the squares of gradients, each averaged over a batch of
/// samples.
fn add_squares(
    network: &Network<'_>,
    weights: &Weights,
    passes: Vec<Pass>,
    (d_output, batch): (Array2<f32>, usize),
    fisher: &mut [Array2<f32>],
) {
    let samples = d_output.nrows();
    let mut d_state = zero_state(network.graph, samples);
    // Per matrix: the gradient at the output and the input of each use.
    let mut uses: Vec<Vec<(Array2<f32>, Array2<f32>)>> = vec![Vec::new(); fisher.len()];
    let silent = Array2::zeros(d_output.raw_dim());
    let mut d_output = Some(d_output);
    for pass in passes.into_iter().rev() {
        let d_output = d_output.take().unwrap_or_else(|| silent.clone());
        for Factors { matrix, x, dy } in network.backward(weights, pass, d_output, &mut d_state).products {
            if dy.iter().any(|d| *d != 0.0) {
                uses[matrix].push((dy, x));
            }
        }
    }
    for (uses, fisher) in uses.iter().zip(fisher) {
        match &uses[..] {
            [] => {}
            // The square of an outer product is the outer product of the squares.
            [(dy, x)] if batch == 1 => general_mat_mul(1.0, &dy.mapv(|d| d * d).t(), &x.mapv(|x| x * x), 1.0, fisher),
            many => {
                for first in (0..samples).step_by(batch) {
                    let batch = first..samples.min(first + batch);
                    let count = batch.len() as f32;
                    let steps: Vec<_> = many
                        .iter()
                        .flat_map(|(dy, x)| batch.clone().map(move |sample| (dy.row(sample), x.row(sample))))
                        .collect();
                    let dy = Array2::from_shape_fn((steps.len(), fisher.nrows()), |(t, r)| steps[t].0[r]);
                    let x = Array2::from_shape_fn((steps.len(), fisher.ncols()), |(t, c)| steps[t].1[c]);
                    Zip::from(&mut *fisher).and(&dy.t().dot(&x)).for_each(|sum, d| *sum += (d / count) * (d / count));
                }
            }
        }
    }
}

/// Returns one step of the chosen episodes, `[episode, value]`.
fn rows(array: &Array3<f32>, episodes: &[usize], step: usize) -> Array2<f32> {
    array.index_axis(Axis(1), step).select(Axis(0), episodes).as_standard_layout().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dataset, lstm, mlp};
    use actq::graph::Derivatives;

    const PLAIN: Sampling = Sampling { samples: 4096, batch: 1, signs: Signs::Random, alpha: 1.0 };

    /// Computes the sum over the recorded dimensions of the action error's magnitude at the last frame of a window.
    fn loss(
        graph: &Graph,
        weights: &Weights,
        dataset: &Dataset,
        episode: usize,
        window: std::ops::Range<usize>,
    ) -> f64 {
        let network = Network::new(graph);
        let mut state = start_state(graph, &[dataset.start(episode)]);
        let mut sum = 0.0;
        for step in 0..window.end {
            let pass = network.forward(weights, rows(&dataset.obs, &[episode], step), &mut state);
            let recorded = dataset.action_at(episode, step).expect("actions");
            sum = pass.output().iter().zip(recorded).map(|(y, t)| f64::from((y - t).abs())).sum();
        }
        sum
    }

    fn compare(graph: &Graph, steps: usize, window: usize, state: Option<Array2<f32>>, batch: usize) {
        // Recorded actions far from the policy's own: no kink nearby, no random signs.
        let mut dataset = Dataset { state, ..dataset(graph, 2, steps) };
        let action = dataset.action.as_mut().expect("actions");
        action.indexed_iter_mut().for_each(|((e, s, d), a)| *a += if (e + s + d) % 3 == 0 { 3.0 } else { -4.0 });
        let sampling = Sampling { batch, ..PLAIN };
        let found = importance(graph, &dataset, sampling, &mut |_| {}).expect("importance");
        let weights = Weights::of(graph);
        let step = 4e-3;
        let starts = || (0..=steps - window).step_by(window);
        let samples: Vec<(usize, usize)> = match graph.state_len() {
            0 => (0..2).flat_map(|episode| starts().map(move |start| (episode, start))).collect(),
            _ => starts().flat_map(|start| (0..2).map(move |episode| (episode, start))).collect(),
        };
        for (m, found) in found.iter().enumerate() {
            for (at, exact) in found.indexed_iter().map(|(at, v)| (at, f64::from(*v))) {
                let gradient = |&(episode, start): &(usize, usize)| {
                    let moved = |d: f32| {
                        let mut moved = weights.clone();
                        moved.matrices[m].set(|values| values[at.0 * found.ncols() + at.1] += d);
                        loss(graph, &moved, &dataset, episode, start..start + window)
                    };
                    (moved(step) - moved(-step)) / (2.0 * f64::from(step))
                };
                let squares = samples.chunks(batch).map(|batch| {
                    let mean = batch.iter().map(gradient).sum::<f64>() / batch.len() as f64;
                    mean.powi(2)
                });
                let expected = squares.sum::<f64>() / samples.len().div_ceil(batch) as f64;
                assert!((exact - expected).abs() < 2e-3 + 0.02 * expected, "{m} {at:?}: {exact} against {expected}");
            }
        }
    }

    #[test]
    fn agrees_with_finite_differences() {
        // Batches of 4 span the end of an episode, and the last one is short.
        for batch in [1, 2, 4] {
            compare(&mlp(), 3, 1, None, batch);
        }
        // One window from the start, which is zero or recorded: nothing is truncated.
        let state = Array2::from_shape_fn((2, 6), |(e, v)| 0.8 - 0.25 * (v + e) as f32);
        for batch in [1, 2] {
            compare(&lstm(), 5, 5, None, batch);
            compare(&lstm(), 5, 5, Some(state.clone()), batch);
        }
    }

    #[test]
    fn alpha_mixes_in_the_likelihood() {
        let graph = mlp();
        let dataset = dataset(&graph, 1, 40);
        let of = |alpha| importance(&graph, &dataset, Sampling { alpha, ..PLAIN }, &mut |_| {}).expect("importance");
        let [likelihood, half, l1] = [0.0, 0.5, 1.0].map(of);
        let finite = |matrices: &[Array2<f32>]| matrices.iter().all(|m| m.iter().all(|i| i.is_finite()));
        assert!(finite(&likelihood) && finite(&half));
        assert!(likelihood != l1 && half != l1 && half != likelihood);
    }

    #[test]
    fn samples_are_limited() {
        let graph = mlp();
        let mut dataset = dataset(&graph, 1, 12);
        dataset.action.as_mut().expect("actions").mapv_inplace(|a| a + 3.0);
        let few = Sampling { samples: 4, ..PLAIN };
        let found = importance(&graph, &dataset, few, &mut |_| {}).expect("importance");
        // Every third frame alone.
        let third = |array: &Array3<f32>| array.slice(s![.., ..;3, ..]).to_owned();
        let thirds = Dataset {
            obs: third(&dataset.obs),
            action: dataset.action.as_ref().map(third),
            length: vec![4],
            ..dataset.clone()
        };
        assert_eq!(found, importance(&graph, &thirds, PLAIN, &mut |_| {}).expect("importance"));
        assert_ne!(found, importance(&graph, &dataset, PLAIN, &mut |_| {}).expect("importance"));
    }

    #[test]
    fn random_signs_give_the_sum_of_squares() {
        let graph = mlp();
        // The same observation many times, with the policy's own actions. They do not deviate, so a difference in the
        // last bit would count: they come from the same pass that they are compared with.
        let mut dataset = dataset(&graph, 1, 1);
        let weights = Weights::of(&graph);
        let network = Network::new(&graph);
        let pass = network.forward(&weights, rows(&dataset.obs, &[0], 0), &mut zero_state(&graph, 1));
        dataset.action = Some(pass.output().clone().insert_axis(Axis(0)));
        for array in [Some(&mut dataset.obs), dataset.action.as_mut()].into_iter().flatten() {
            *array = ndarray::concatenate(Axis(1), &vec![array.view(); 4000]).expect("same shapes");
        }
        dataset.length = vec![4000];
        let found = importance(&graph, &dataset, PLAIN, &mut |_| {}).expect("importance");
        let gradient = |d_output: Array2<f32>| {
            let pass = network.forward(&weights, rows(&dataset.obs, &[0], 0), &mut zero_state(&graph, 1));
            let derivatives = network.backward(&weights, pass, d_output, &mut zero_state(&graph, 1));
            Derivatives::sum(&graph, vec![derivatives]).0.swap_remove(0)
        };
        let mut expected = Array2::<f32>::zeros(found[0].raw_dim());
        for d in 0..2 {
            let unit = Array2::from_shape_fn((1, 2), |(_, k)| if k == d { 1.0 } else { 0.0 });
            expected += &gradient(unit).mapv(|g| g * g);
        }
        let of_both = gradient(Array2::ones((1, 2)));
        let largest = expected.iter().copied().fold(0.0, f32::max);
        for (found, expected) in found[0].iter().zip(&expected) {
            assert!((found - expected).abs() < 0.05 * largest, "{found} against {expected}");
        }

        // Without random signs, equal actions give 0, and the smallest difference counts in full.
        let loss = Sampling { signs: Signs::Loss, ..PLAIN };
        let found = importance(&graph, &dataset, loss, &mut |_| {}).expect("importance");
        assert!(found.iter().all(|matrix| matrix.iter().all(|i| *i == 0.0)), "{found:?}");
        dataset.action.as_mut().expect("actions").mapv_inplace(|a| a + 1e-6);
        let found = importance(&graph, &dataset, loss, &mut |_| {}).expect("importance");
        for (found, gradient) in found[0].iter().zip(&of_both) {
            assert!((found - gradient * gradient).abs() < 1e-3 * largest, "{found} against {gradient} squared");
        }
    }

    #[test]
    fn episodes_of_different_lengths_count_in_full() {
        let graph = lstm();
        let mut dataset = dataset(&graph, 3, 40);
        dataset.length = vec![40, 7, 20];
        let found = importance(&graph, &dataset, PLAIN, &mut |_| {}).expect("importance");
        assert!(found.iter().all(|m| m.iter().all(|v| v.is_finite()) && m.sum() > 0.0));
    }
}
