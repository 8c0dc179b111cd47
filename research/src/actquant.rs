//! ActQuant (Akbari et al., "Sub-4-bit Action-Guided Quantization for Vision-Language-Action Models", arXiv
//! 2605.24011).
//!
//! Stage 1 gives each matrix a width. [`score`] measures by HSIC how much the matrix adds to the information of its
//! values about the actions, and [`allocation`] spends the budget on these scores. Stage 2 fits the scales inside a
//! matrix. They minimize the rounding error weighted by the [Fisher](fisher) information of the action loss, by the
//! same search as plain rounding. If the budget is one width for all, stage 1 is skipped.
//!
//! Every deviation from the paper or its authors' code is a [choice](choices); `research/README.md` lists them all.

pub mod allocation;
pub mod choices;
pub mod fisher;
pub mod hsic;
pub mod loss;
pub mod score;

use std::collections::BTreeMap;

use actq::budget::Rate;
use actq::data::Dataset;
use actq::error::{Result, ensure};
use actq::graph::{Graph, WeightMatrix};
use actq::methods::scale::{Scales, round_to};
use actq::methods::{CustomMethod, CustomStatistics, Options, Outcome, Packing, Quantized};
use actq_kernels::layout::Width;
use ndarray::Array2;

use choices::Choices;
use score::Score;

/// Least importance of a weight, as a share of its matrix's mean importance. It decides if no recorded frame gives
/// information, as for rows after a ReLU that never fires.
const FLOOR: f64 = 1e-6;

/// The method, with its choices.
#[derive(Clone, Copy, Debug)]
pub struct ActQuant(pub Choices);

impl CustomMethod for ActQuant {
    fn name(&self) -> String {
        if self.0 == Choices::default() { "actquant".to_owned() } else { format!("actquant ({})", self.0) }
    }

    fn default_group(&self) -> usize {
        32
    }

    fn widest(&self) -> Width {
        self.0.widest
    }

    fn least_bytes(&self, graph: &Graph, packing: Packing) -> usize {
        allocation::least_bytes(graph, &self.0, packing)
    }

    fn prepare(
        &self,
        graph: &Graph,
        calib: &Dataset,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Box<dyn CustomStatistics>> {
        Ok(Box::new(ActionStatistics::collect(graph, calib, self.0, progress)?))
    }
}

/// ActQuant's statistics of the recorded observations, for any number of budgets.
#[derive(Clone, Debug)]
pub struct ActionStatistics {
    /// Choices by which they were taken and are used.
    pub choices: Choices,
    /// Scores of stage 1, per matrix.
    pub scores: Vec<Score>,
    /// Importance of stage 2, per matrix `[rows, cols]`.
    pub importance: Vec<Array2<f32>>,
}

impl ActionStatistics {
    /// Runs the f32 network over `dataset`, which must hold actions. `progress` receives the share done.
    pub fn collect(graph: &Graph, dataset: &Dataset, choices: Choices, progress: &mut dyn FnMut(f64)) -> Result<Self> {
        let path = dataset.path.display();
        ensure!(dataset.action.is_some(), "{path}: array \"action\" is missing; actquant needs recorded actions");
        Ok(Self {
            choices,
            scores: score::scores(graph, dataset, choices.frames, choices.bandwidth)?,
            importance: fisher::importance(graph, dataset, choices.fisher, progress)?,
        })
    }

    /// Returns the scores of the allocation: the chosen score, with negative ones as 0. If none is above 0, it returns
    /// 1 for every matrix and `true`: such scores give every layer the same claim.
    pub fn effective_scores(&self) -> (Vec<f64>, bool) {
        let scores: Vec<f64> = self.scores.iter().map(|s| s.of(self.choices.score).max(0.0)).collect();
        if scores.iter().all(|s| *s == 0.0) { (vec![1.0; scores.len()], true) } else { (scores, false) }
    }

    /// Returns the importance of every weight in the fits of scales, per matrix: its importance plus `FLOOR`, and if
    /// so chosen, [`by_magnitude`].
    pub fn weight_importance(&self, graph: &Graph) -> Vec<Vec<f64>> {
        let matrices = graph.matrices.iter().zip(&self.importance);
        let weighed = |(matrix, importance): (&WeightMatrix, &Array2<f32>)| {
            let importance = floored(importance);
            if self.choices.magnitude { by_magnitude(importance, matrix) } else { importance }
        };
        matrices.map(weighed).collect()
    }
}

impl CustomStatistics for ActionStatistics {
    fn quantize(&self, graph: &Graph, rate: Rate, options: &Options) -> Result<Vec<Outcome>> {
        let widths = match rate {
            Rate::Width(width) => vec![width; graph.matrices.len()],
            Rate::BitsPerWeight(_) | Rate::Bytes(_) | Rate::Within { .. } => {
                let (scores, limit) = (self.effective_scores().0, rate.bytes(graph.weights()));
                allocation::allocate(graph, &scores, &self.choices, options.packing(), limit)?
            }
        };
        let importance = self.weight_importance(graph);
        let matrices = graph.matrices.iter().zip(widths).zip(&importance);
        matrices
            .map(|((matrix, width), importance)| {
                let quantized = quantize_matrix(matrix, width, options.group, importance);
                Outcome::new(matrix, quantized, None, options.activations)
            })
            .collect()
    }

    fn scores(&self) -> Vec<BTreeMap<String, f64>> {
        self.scores.iter().map(Score::figures).collect()
    }
}

/// Rounds to nearest with scales that minimize `sum of importance * error^2` of each group, or of each row.
fn quantize_matrix(matrix: &WeightMatrix, width: Width, group: usize, importance: &[f64]) -> Quantized {
    round_to(matrix, width, Scales::fit(matrix, &vec![Some(width); matrix.rows], group, importance))
}

/// Multiplies every importance of a matrix by `sqrt(mean of the row's w^2 + w^2)`, as llama.cpp's fits do.
pub fn by_magnitude(mut importance: Vec<f64>, matrix: &WeightMatrix) -> Vec<f64> {
    let cols = matrix.cols.max(1);
    for (importance, row) in importance.chunks_mut(cols).zip(matrix.data.chunks(cols)) {
        let square = |w: &f32| f64::from(*w).powi(2);
        let mean = row.iter().map(square).sum::<f64>() / row.len() as f64;
        importance.iter_mut().zip(row).for_each(|(h, w)| *h *= (mean + square(w)).sqrt());
    }
    importance
}

fn floored(importance: &Array2<f32>) -> Vec<f64> {
    let mean = importance.iter().map(|&i| f64::from(i)).sum::<f64>() / importance.len().max(1) as f64;
    let least = if mean > 0.0 { FLOOR * mean } else { 1.0 };
    importance.iter().map(|&i| f64::from(i) + least).collect()
}

#[cfg(test)]
mod tests {
    use actq::budget::Budget;
    use actq::data::Recordings;
    use actq::measure::eval;
    use actq::methods::{Method, scale};
    use actq::pipeline::Quantizer;
    use actq::policy::Policy;

    use super::*;
    use crate::testing;
    use choices::ScoreOf;

    fn quantize_at(graph: &Graph, statistics: &ActionStatistics, rate: Rate) -> Result<Vec<Outcome>> {
        let method = Method::custom(ActQuant(statistics.choices));
        let options = Options { group: 32, ..Options::new(method, Budget::BitsPerWeight(3.0)) };
        statistics.quantize(graph, rate, &options)
    }

    #[test]
    fn missing_actions_do_not_change_errors() {
        let policy = Policy::of("tiny", testing::lstm());
        let with_actions = [5, 6].map(|seed| testing::dataset(&policy.graph, seed, 20));
        let without = with_actions.clone().map(|recording| Dataset { action: None, ..recording });
        let nmse = |[calib, heldout]: [Dataset; 2]| {
            let method = Method::custom(ActQuant(Choices::default()));
            let mut recordings = Recordings { calib: Some(calib), heldout: Some(heldout) };
            recordings.fill_actions(&policy.graph);
            let quantizer = Quantizer::new(&policy, &recordings, method.clone(), None, |_| {}).expect("statistics");
            let measured = |bits| {
                let options = Options { group: 32, ..Options::new(method.clone(), Budget::BitsPerWeight(bits)) };
                let made = quantizer.quantize(&options, ()).ok()?;
                let (buffer, heldout) = (made.buffer(), recordings.heldout.as_ref()?);
                let image = buffer.image(std::path::Path::new("image in memory")).expect("an image");
                Some(eval::evaluate(image, heldout).expect("an error").nmse)
            };
            [50.0, 100.0].map(measured)
        };
        let measured = nmse(with_actions);
        assert!(measured.iter().any(Option::is_some), "{measured:?}");
        assert_eq!(nmse(without), measured);
    }

    #[test]
    fn scales_follow_the_importance() {
        let data: Vec<f32> = (0..64).map(|i| (i as f32 * 0.7).sin()).collect();
        let matrix = WeightMatrix { name: "w".into(), rows: 2, cols: 32, data };
        // Only the even columns of row 0 and the odd ones of row 1 matter.
        let importance = Array2::from_shape_fn((2, 32), |(r, c)| if r == c % 2 { 1.0 } else { 0.0 });
        let error = |quantized: &Quantized| -> f64 {
            let values = quantized.dequantized();
            (0..64).map(|i| f64::from(importance[(i / 32, i % 32)] * (values[i] - matrix.data[i]).powi(2))).sum()
        };
        for width in [Width::W2, Width::W3] {
            for group in [0, 32] {
                let weighted = error(&quantize_matrix(&matrix, width, group, &floored(&importance)));
                let plain = error(&scale::round_to_nearest(&matrix, width, group));
                assert!(weighted < plain, "{width:?} group {group}: {weighted} against {plain}");
            }
        }
    }

    #[test]
    fn equal_or_no_importance_equals_plain_rounding() {
        let data: Vec<f32> = (0..80).map(|i| (i as f32 * 1.3).cos()).collect();
        let matrix = WeightMatrix { name: "w".into(), rows: 2, cols: 40, data };
        let plain = scale::round_to_nearest(&matrix, Width::W3, 32);
        for level in [0.0, 2.0] {
            let found = quantize_matrix(&matrix, Width::W3, 32, &floored(&Array2::from_elem((2, 40), level)));
            assert_eq!((found.codes, found.scales), (plain.codes.clone(), plain.scales.clone()));
        }
    }

    #[test]
    fn budgets_and_fixed_widths_are_kept() {
        let graph = testing::lstm();
        let dataset = testing::dataset(&graph, 2, 24);
        let statistics =
            ActionStatistics::collect(&graph, &dataset, Choices::default(), &mut |_| {}).expect("statistics");
        let uniform = quantize_at(&graph, &statistics, Rate::Width(Width::W3)).expect("quantized");
        assert!(uniform.iter().all(|o| o.quantized.widths.iter().all(|w| *w == Some(Width::W3))));
        let bytes = |outcomes: &[Outcome]| -> usize { outcomes.iter().map(|o| o.bytes()).sum() };
        let limit = 8.0 * (bytes(&uniform) + 40) as f64 / graph.weights() as f64;
        let mixed = quantize_at(&graph, &statistics, Rate::BitsPerWeight(limit)).expect("quantized");
        assert!(8.0 * bytes(&mixed) as f64 / graph.weights() as f64 <= limit);
        let error = quantize_at(&graph, &statistics, Rate::BitsPerWeight(0.5)).expect_err("too small");
        assert!(error.budget().is_some());
    }

    #[test]
    fn missing_actions_are_refused_and_negative_scores_equalized() {
        let graph = testing::mlp();
        let mut dataset = testing::dataset(&graph, 1, 8);
        dataset.action = None;
        let error =
            ActionStatistics::collect(&graph, &dataset, Choices::default(), &mut |_| {}).expect_err("no actions");
        assert!(error.to_string().contains("\"action\" is missing"), "{error}");
        let zero = Score { x_input: 0.0, y_input: 1.0, x_output: 0.0, y_output: 0.5 };
        let choices = Choices::default();
        let mut statistics = ActionStatistics { choices, scores: vec![zero; 2], importance: Vec::new() };
        assert_eq!(statistics.effective_scores(), (vec![1.0; 2], true));
        statistics.choices.score = ScoreOf::Output;
        assert_eq!(statistics.effective_scores(), (vec![0.5; 2], false));
    }

    #[test]
    fn magnitude_favours_large_weights() {
        let matrix = WeightMatrix { name: "w".into(), rows: 2, cols: 2, data: vec![3.0, -1.0, 0.0, 0.0] };
        // The mean square of the first row is 5.
        let expected = [14f64.sqrt(), 2.0 * 6f64.sqrt(), 0.0, 0.0];
        for (found, expected) in by_magnitude(vec![1.0, 2.0, 1.0, 1.0], &matrix).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
        }
        let graph = Graph { matrices: vec![matrix], ..Graph::new(2) };
        let statistics = |magnitude| ActionStatistics {
            choices: Choices { magnitude, ..Choices::default() },
            scores: Vec::new(),
            importance: vec![Array2::ones((2, 2))],
        };
        let of = |magnitude| statistics(magnitude).weight_importance(&graph);
        assert_eq!(of(true)[0], by_magnitude(of(false)[0].clone(), &graph.matrices[0]));
    }
}
