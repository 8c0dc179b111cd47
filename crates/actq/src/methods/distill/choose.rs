//! Chooses between learning and feedback by the errors on whole held-out episodes. `trials.rs` serves networks that
//! have lost most of their weights: feedback makes up for rounding, and not for rows that were removed.
//!
//! Each has three quarters of the episodes, and learning an eighth of its steps. The error is measured on the other
//! episodes, at the recorded observations and at widened ones. The lower error at the recorded observations decides for
//! a feed-forward network, that at widened ones for a recurrent network. The best widening for learning cannot be found
//! in this way: the differences are chance (docs/records/2026-11-26-cells.md).

use nalgebra::DMatrix;

use super::schedule::Bounds;
use super::train::{Task, distill, recorded_error};
use crate::calibrate::moments::Moments;
use crate::calibrate::sensitivity::{DAMPING_INPUT, drawn_moments};
use crate::calibrate::widening::Widening;
use crate::calibrate::windows::Windows;
use crate::graph::{Graph, Network};
use crate::methods::learning::{Choice, Trial};
use crate::methods::quantized::{Quantized, dequantized};

/// Least steps of which a part is spent on choices.
pub(super) const MIN_STEPS: usize = 3000;
/// Divisor of the steps, and of the time, for one choice.
const TRIAL_STEP_DIVISOR: usize = 8;
const TRIAL_TIME_DIVISOR: u32 = 12;
/// Predicted ratio of the errors after all steps and after an eighth of them: 0.6 to 1.15, 0.81 on average
/// (docs/records/2026-11-22-choice.md).
const ERROR_RATIO: f64 = 0.8;
/// Relative difference of errors on a few episodes that counts as chance (docs/records/2026-11-23-hold.md).
const CHANCE: f64 = 0.05;
/// Dampings of feedback to try.
const DAMPINGS: [f64; 2] = [DAMPING_INPUT, 0.03];

/// Feedback from moments and a damping.
pub type Feedback<'f> = dyn Fn(&[(Moments, DMatrix<f64>)], f64) -> (Vec<Quantized>, Graph) + 'f;

/// Result of the choice.
#[derive(Debug)]
pub struct Chosen {
    /// Selected way.
    pub choice: Choice,
    /// Remaining limits of learning.
    pub bounds: Bounds,
    /// Ways that were compared.
    pub tried: Vec<Trial>,
    /// Approximate share of the choice in all the work.
    pub share: f64,
}

impl Chosen {
    /// Returns a choice without trials.
    pub(super) fn untried(choice: Choice, bounds: Bounds) -> Self {
        Self { choice, bounds, tried: Vec::new(), share: 0.0 }
    }
}

/// Share of a trial in all the work.
const TRIAL_SHARE: f64 = 1.0 / (TRIAL_STEP_DIVISOR + 1) as f64;

/// Tries all choices. If no episode can be held out, or few steps are to be learned, it tries nothing. It does not try
/// feedback for an iterative head, since moments over all denoising steps take longer than the result is worth.
pub fn choose(
    task: &Task<'_>,
    windows: &Windows,
    feedback: &Feedback<'_>,
    progress: &mut dyn FnMut(f64, f64),
) -> Chosen {
    let Bounds { steps, time } = task.bounds;
    let learns = steps != Some(0);
    let untried = if learns { Choice::Learning(task.recipe) } else { Choice::Feedback { damping: DAMPING_INPUT } };
    let untried = Chosen::untried(untried, task.bounds);
    let iterative = task.graph.denoising_steps() > 1;
    let few = learns && steps.is_some_and(|steps| steps < MIN_STEPS);
    if few || !learns && iterative {
        return untried;
    }
    let Some((learned_from, held_out)) = windows.split() else { return untried };
    let mut tried = Vec::new();
    let mut try_out = |choice, (quantized, graph): (Vec<Quantized>, Graph)| {
        let [recorded, widened] = errors(task, &graph, &quantized, &held_out);
        tried.push(Trial { choice, recorded, widened });
    };
    if !iterative {
        let moments = drawn_moments(&learned_from, task.seed);
        for damping in DAMPINGS {
            try_out(Choice::Feedback { damping }, feedback(&moments, damping));
        }
    }
    if learns {
        let bounds = Bounds {
            steps: steps.map(|steps| steps / TRIAL_STEP_DIVISOR),
            time: time.map(|time| time / TRIAL_TIME_DIVISOR),
        };
        let trial = Task { bounds, watched: None, ..task.clone() };
        let learned = distill(&trial, &learned_from, &mut |now| progress(TRIAL_SHARE * now.share, now.error));
        try_out(Choice::Learning(task.recipe), (learned.quantized, learned.graph));
    }
    let choice = lowest_error(&tried, windows.recurrent()).map_or(untried.choice, |best| best.choice);
    let remaining = time.map(|time| time - time / TRIAL_TIME_DIVISOR);
    Chosen { choice, bounds: Bounds { steps, time: remaining }, tried, share: TRIAL_SHARE }
}

/// Returns the trial with the lowest expected error. Among those whose errors on the path differ by chance only, it is
/// the one with the lowest error off it. Feedback is complete here, whereas learning has had an eighth of its steps.
pub(super) fn lowest_error(tried: &[Trial], recurrent: bool) -> Option<&Trial> {
    let remaining = |tried: &Trial| if matches!(tried.choice, Choice::Learning(_)) { ERROR_RATIO } else { 1.0 };
    let widened = |tried: &Trial| remaining(tried) * tried.widened;
    let expected = |tried: &Trial| if recurrent { widened(tried) } else { remaining(tried) * tried.recorded };
    let lowest = tried.iter().map(expected).min_by(f64::total_cmp)?;
    let alike = tried.iter().filter(|tried| expected(tried) <= (1.0 + CHANCE) * lowest);
    alike.min_by(|a, b| widened(a).total_cmp(&widened(b)))
}

/// Returns the errors of a network at recorded and at widened observations, the same ones for every choice.
pub(super) fn errors(task: &Task<'_>, graph: &Graph, quantized: &[Quantized], windows: &Windows) -> [f64; 2] {
    let network = Network::rounded(graph, task.x_max);
    let weights = dequantized(graph, quantized);
    [None, Some(Widening::WIDE)].map(|widening| recorded_error(&network, &weights, windows, widening, task.seed))
}

#[cfg(test)]
mod tests {
    use actq_kernels::Width;

    use super::*;
    use crate::budget::{Budget, Rate};
    use crate::methods::learning::Recipe;
    use crate::methods::{Learning, Method, Options, PreparedMethod};
    use crate::testing::{dataset, mlp};

    fn chosen(episodes: usize, steps: usize) -> Learning {
        let graph = mlp();
        let recording = dataset(&graph, episodes, 240 / episodes);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let options = Options { steps: Some(steps), ..Options::new(Method::Distill, Budget::Width(Width::W3)) };
        let found = method.quantize(Rate::Width(Width::W3), &options, |_| {}).expect("quantized");
        found.learning.expect("distill learns")
    }

    #[test]
    fn without_learning_the_better_damping_is_taken() {
        let Learning { steps, choice, tried, .. } = chosen(4, 0);
        assert_eq!((steps, tried.len()), (0, DAMPINGS.len()));
        assert_eq!(lowest_error(&tried, false).map(|tried| tried.choice), Some(choice));
    }

    #[test]
    fn with_enough_steps_feedback_competes_with_learning() {
        let Learning { choice, tried, .. } = chosen(4, MIN_STEPS);
        let (compared, after) = tried.split_at(DAMPINGS.len() + 1);
        let first = lowest_error(compared, false).map(|tried| tried.choice);
        // What learning gave in the end is compared, too, if it is discarded.
        assert_eq!(Some(choice), after.last().map(|tried| tried.choice).or(first));
    }

    #[test]
    fn learning_that_raises_the_error_is_discarded() {
        let Learning { steps, discarded, choice, tried } = chosen(4, MIN_STEPS);
        assert!(steps == 0 && discarded > 0, "{steps} {discarded}");
        assert_eq!(choice, Choice::Feedback { damping: DAMPING_INPUT });
        let [.., learned, fed_back] = tried[..] else { panic!("{tried:?}") };
        assert!(learned.recorded > fed_back.recorded && fed_back.choice == choice);
    }

    #[test]
    fn feedback_must_beat_the_predicted_learning_error() {
        let learned = |noise: f32, recorded, widened| {
            let choice = Choice::Learning(Recipe::new(Widening { noise, ..Widening::WIDE }));
            Trial { choice, recorded, widened }
        };
        let fed_back = |recorded| Trial { choice: Choice::Feedback { damping: 0.01 }, recorded, widened: 9.0 };
        let [a, b] = [learned(0.1, 1.2, 2.0), learned(0.2, 1.0, 3.0)];
        let choice = |tried: &[Trial], recurrent| lowest_error(tried, recurrent).map(|tried| tried.choice);
        assert_eq!([choice(&[a, b], false), choice(&[a, b], true)], [Some(b.choice), Some(a.choice)]);
        let [worse, better] = [fed_back(0.85), fed_back(0.75)];
        assert_eq!(choice(&[worse, a, b], false), Some(b.choice));
        assert_eq!(choice(&[worse, better, a, b], false), Some(better.choice));
        assert_eq!(choice(&[better, a, b], true), Some(a.choice), "it is far off beside the path");
        assert_eq!(choice(&[worse, better], false), Some(better.choice));
        assert_eq!(choice(&[], false), None);
        let wider = learned(0.3, 1.04, 2.9);
        assert_eq!(choice(&[b, wider], false), Some(wider.choice), "as good on the path, and better off it");
    }

    #[test]
    fn one_episode_or_few_steps_skip_the_choice() {
        let found = |Learning { choice, tried, .. }: Learning| (choice, tried.len());
        assert_eq!(found(chosen(1, 0)), (Choice::Feedback { damping: DAMPING_INPUT }, 0));
        assert_eq!(found(chosen(4, 8)), (Choice::Learning(Recipe::new(Widening::OF_FRAMES)), 0));
    }
}
