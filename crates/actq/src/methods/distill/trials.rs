//! Chooses how to learn a network that has lost most of its weights, by short learning trials.
//!
//! Short trials choose three things: the learning rate, the factor on rounding error (many narrow rows or few wide
//! ones), and the ranking of hidden vectors. None can be predicted. The best rate of a small network may be several
//! times that of a large one. A network can learn to compensate a part of its rounding error; a factor on that error
//! gives several shapes for one budget. And if nearly all elements are removed, measured errors of removal do not rank
//! the vectors well ([`even_layer_errors`]).
//!
//! The rates come first, then the shapes at the best rate: by measured errors, and by those of even layers with the
//! best factor and its neighbours. After a tenth of the steps, the order of the trials is nearly the final one. All
//! trials learn from all episodes, and their errors are those at the recorded observations. Shapes of one budget
//! overfit alike, and the differences on a quarter of the episodes are mostly chance. Higher rates are tried if less
//! than a quarter of the weights is left. Larger networks overfit more at them, which trials do not show, and gain
//! little (docs/records/2026-11-26-trials.md).

use super::candidate::Candidate;
use super::choose::{Chosen, MIN_STEPS, errors, lowest_error};
#[cfg(doc)]
use super::removal::even_layer_errors;
use super::schedule::Bounds;
use super::shape::Target;
use super::train::{Baseline, Task, distill};
use crate::methods::learning::{Choice, Recipe, Trial};

/// Factors on the learning rates. Recurrent networks use only the first, since their rates hardly depend on the size.
/// Even layers gave them the same shapes, or no better ones, and their trials take longest.
const RATES: [f32; 3] = [1.0, 4.0, 8.0];
/// Factors on the rounding error: powers of 4.
const ROUNDINGS: [f64; 4] = [1.0, ROUNDING_RATIO, ROUNDING_RATIO * ROUNDING_RATIO, MAX_ROUNDING];
const ROUNDING_RATIO: f64 = 4.0;
const MAX_ROUNDING: f64 = ROUNDING_RATIO * ROUNDING_RATIO * ROUNDING_RATIO;
/// Most trials with even layers.
const MAX_EVEN_TRIALS: usize = 3;
/// Divisor of the steps, and of the time, for a trial.
const TRIAL_STEP_DIVISOR: usize = 10;
const TRIAL_TIME_DIVISOR: u32 = 20;

/// Chooses the learning rate and the shape of a network, whose first shape is given. If few steps are to be learned, it
/// runs no trials.
pub(super) fn choose_recipe(
    goal: Target<'_>,
    first: Candidate,
    recipe: Recipe,
    progress: &mut dyn FnMut(f64, f64),
) -> (Candidate, Chosen) {
    let windows = &goal.statistics.windows;
    let Bounds { steps, time } = goal.statistics.bounds(goal.options);
    if steps.is_some_and(|steps| steps < MIN_STEPS) {
        return (first, Chosen::untried(Choice::Learning(recipe), Bounds { steps, time }));
    }
    let small = first.task(goal, recipe).keeps_less_than_a_quarter(windows);
    let rates = if small && !windows.recurrent() { &RATES[..] } else { &RATES[..1] };
    let evenness = if windows.recurrent() { &[false][..] } else { &[false, true] };
    let most_trials = rates.len() + ROUNDINGS.len() - 1 + (evenness.len() - 1) * MAX_EVEN_TRIALS;
    let work = (TRIAL_STEP_DIVISOR + most_trials) as f64;
    let bounds = Bounds {
        steps: steps.map(|steps| steps / TRIAL_STEP_DIVISOR),
        time: time.map(|time| time / TRIAL_TIME_DIVISOR),
    };
    let mut attempt = |candidate: &Candidate, recipe: Recipe, before: usize| {
        let task = Task { bounds, watched: None, ..candidate.task(goal, recipe) };
        let mut progress = |now: Baseline| progress((before as f64 + now.share) / work, now.error);
        let learned = distill(&task, windows, &mut progress);
        let [recorded, widened] = errors(&task, &learned.graph, &learned.quantized, windows);
        Trial { choice: Choice::Learning(recipe), recorded, widened }
    };
    let chosen = |tried: &[Trial]| match lowest_error(tried, windows.recurrent()) {
        Some(Trial { choice: Choice::Learning(recipe), .. }) => *recipe,
        _ => recipe,
    };
    let mut tried = Vec::new();
    for &rate in rates {
        tried.push(attempt(&first, Recipe { rate, ..recipe }, tried.len()));
    }
    let recipe = chosen(&tried);
    let mut of_shapes: Vec<Trial> =
        tried.iter().filter(|tried| tried.choice == Choice::Learning(recipe)).copied().collect();
    let mut candidates = vec![(recipe, first)];
    for &even in evenness {
        let Recipe { rounding: best, .. } = chosen(&of_shapes);
        let near: [f64; MAX_EVEN_TRIALS] = [best / ROUNDING_RATIO, best, ROUNDING_RATIO * best];
        let roundings = if even { &near[..] } else { &ROUNDINGS[1..] };
        for &rounding in roundings.iter().filter(|rounding| **rounding >= ROUNDINGS[0]) {
            let recipe = Recipe { rounding, even, ..recipe };
            // A shape that does not fit is none.
            let Ok(candidate) = Candidate::new(goal, recipe) else { continue };
            if candidates.iter().all(|(_, other)| !other.shape.equals(&candidate.shape)) {
                let of_shape = attempt(&candidate, recipe, tried.len());
                tried.push(of_shape);
                of_shapes.push(of_shape);
                candidates.push((recipe, candidate));
            }
        }
    }
    let recipe = chosen(&of_shapes);
    let index = candidates.iter().position(|(of, _)| *of == recipe).unwrap_or_default();
    let (_, candidate) = candidates.swap_remove(index);
    let share = tried.len() as f64 / (TRIAL_STEP_DIVISOR + tried.len()) as f64;
    let remaining = time.map(|time| time - time / TRIAL_TIME_DIVISOR * tried.len() as u32);
    (candidate, Chosen { choice: Choice::Learning(recipe), bounds: Bounds { steps, time: remaining }, tried, share })
}

#[cfg(test)]
mod tests {
    use actq_kernels::Width;

    use super::*;
    use crate::budget::{Budget, Rate};
    use crate::methods::learning::Learning;
    use crate::methods::{Method, Options, PreparedMethod};
    use crate::testing::{dataset, layers};

    /// Learns the network within few bytes.
    fn learning(steps: usize) -> Learning {
        let graph = layers(&[6, 48, 32, 4]);
        let recording = dataset(&graph, 4, 60);
        let method = PreparedMethod::new(&graph, Method::Distill, Some(&recording), |_| {}).expect("statistics");
        let options = Options { steps: Some(steps), ..Options::new(Method::Distill, Budget::Width(Width::W2)) };
        let mut last = 0.0;
        let found = method.quantize(Rate::BitsPerWeight(1.2), &options, |progress| {
            assert!((last..=1.0).contains(&progress.share()), "{} after {last}", progress.share());
            last = progress.share();
        });
        found.expect("quantized").learning.expect("distill learns")
    }

    fn recipe(choice: Choice) -> Recipe {
        match choice {
            Choice::Learning(recipe) => recipe,
            Choice::Feedback { .. } => panic!("feedback cannot replace rows"),
        }
    }

    #[test]
    fn rates_are_tried_and_then_shapes() {
        let Learning { choice, tried, .. } = learning(MIN_STEPS);
        let recipes: Vec<Recipe> = tried.iter().map(|tried| recipe(tried.choice)).collect();
        let (of_rates, of_shapes) = recipes.split_at(RATES.len());
        assert_eq!(
            of_rates.iter().map(|recipe| (recipe.rate, recipe.rounding)).collect::<Vec<_>>(),
            RATES.map(|r| (r, 1.0))
        );
        let Recipe { rate, .. } = recipe(lowest_error(&tried[..RATES.len()], false).expect("a best").choice);
        assert!(!of_shapes.is_empty() && of_shapes.iter().all(|recipe| recipe.rate == rate), "{of_shapes:?}");
        let first_even = of_shapes.iter().position(|recipe| recipe.even).expect("even layers are tried");
        let (measured, even) = of_shapes.split_at(first_even);
        assert!(measured.iter().all(|of| ROUNDINGS[1..].contains(&of.rounding)), "{measured:?}");
        assert!(even.len() <= MAX_EVEN_TRIALS && even.iter().all(|of| of.even), "{even:?}");
        let at_rate: Vec<Trial> = tried.iter().filter(|tried| recipe(tried.choice).rate == rate).copied().collect();
        assert_eq!(lowest_error(&at_rate, false).map(|tried| tried.choice), Some(choice));
    }

    #[test]
    fn few_steps_skip_the_trials() {
        let Learning { steps, discarded, choice, tried } = learning(20);
        assert_eq!(steps + discarded, 20);
        // What learning gave in the end is compared with feedback if it is discarded.
        assert_eq!(tried.len(), if discarded > 0 { 2 } else { 0 });
        let Recipe { rate, rounding, even, .. } = recipe(tried.first().map_or(choice, |learned| learned.choice));
        assert_eq!((rate, rounding, even), (1.0, 1.0, false));
    }
}
