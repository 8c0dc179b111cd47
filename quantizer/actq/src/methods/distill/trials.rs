//! Chooses how to learn a network that has lost most of its weights, by short learning trials.
//!
//! Three things cannot be predicted. One is the learning rate, which may be several times as high for a small network as
//! for a large one. Another is how much of the error of rounding such a network can learn to make up for. It decides
//! between many rows of few bits and few rows of many: a factor on that error gives several shapes for one budget.
//! The third is which vectors lose most: measured errors of removal say little where nearly all elements go ([`evened`]).
//! First come the rates, then the shapes at the best rate: by measured errors, and by evened ones with the best factor
//! and its neighbours. After a tenth of the steps their order is nearly that of the
//! end. All trials learn from all episodes, and their errors are those at the recorded observations: shapes of one
//! budget overfit alike, and the differences on a quarter of the episodes are mostly chance. Higher rates are
//! tried where less than a quarter of the weights is left: larger networks overfit more at them, which trials do not
//! see, and gain little (docs/records/2026-11-26-trials.md).

use super::candidate::Candidate;
use super::choose::{Chosen, LEAST_STEPS, best, errors};
#[cfg(doc)]
use super::removal::evened;
use super::schedule::Bounds;
use super::shape::Goal;
use super::train::{Present, Task, distill};
use crate::methods::learning::{Choice, Recipe, Tried};

/// Factors on the learning rates. Of recurrent networks, the first: their rates hardly depend on the size. Evened errors
/// gave them the same shapes, or no better ones, and their trials take longest.
const RATES: [f32; 3] = [1.0, 4.0, 8.0];
/// Factors on the error of rounding, each times [`NEXT`].
const ROUNDINGS: [f64; 4] = [1.0, NEXT, NEXT * NEXT, NEXT * NEXT * NEXT];
const NEXT: f64 = 4.0;
/// Most of these factors with evened errors.
const EVEN: usize = 3;
/// Divisor of the steps, and of the time, for a trial.
const STEPS: usize = 10;
const TIME: u32 = 20;

/// Chooses the learning rate and the shape of a network, whose first shape is given. If few steps are to be learned, it
/// tries nothing.
pub(super) fn choose_recipe(
    goal: Goal<'_>,
    first: Candidate,
    recipe: Recipe,
    progress: &mut dyn FnMut(f64, f64),
) -> (Candidate, Chosen) {
    let windows = &goal.statistics.windows;
    let Bounds { steps, time } = goal.statistics.bounds(goal.options);
    if steps.is_some_and(|steps| steps < LEAST_STEPS) {
        return (first, Chosen::untried(Choice::Learning(recipe), Bounds { steps, time }));
    }
    let small = first.task(goal, recipe).is_small_beside(windows);
    let rates = if small && !windows.recurrent() { &RATES[..] } else { &RATES[..1] };
    let laws = if windows.recurrent() { &[false][..] } else { &[false, true] };
    let most = (STEPS + rates.len() + ROUNDINGS.len() - 1 + (laws.len() - 1) * EVEN) as f64;
    let bounds = Bounds { steps: steps.map(|steps| steps / STEPS), time: time.map(|time| time / TIME) };
    let mut attempt = |candidate: &Candidate, recipe: Recipe, before: usize| {
        let task = Task { bounds, watched: None, ..candidate.task(goal, recipe) };
        let mut progress = |now: Present| progress((before as f64 + now.share) / most, now.error);
        let learned = distill(&task, windows, &mut progress);
        let [recorded, widened] = errors(&task, &learned.graph, &learned.quantized, windows);
        Tried { choice: Choice::Learning(recipe), recorded, widened }
    };
    let chosen = |tried: &[Tried]| match best(tried, windows.recurrent()) {
        Some(Tried { choice: Choice::Learning(recipe), .. }) => *recipe,
        _ => recipe,
    };
    let mut tried = Vec::new();
    for &rate in rates {
        tried.push(attempt(&first, Recipe { rate, ..recipe }, tried.len()));
    }
    let recipe = chosen(&tried);
    let mut of_shapes: Vec<Tried> =
        tried.iter().filter(|tried| tried.choice == Choice::Learning(recipe)).copied().collect();
    let mut candidates = vec![(recipe, first)];
    for &even in laws {
        let Recipe { rounding: best, .. } = chosen(&of_shapes);
        let near: [f64; EVEN] = [best / NEXT, best, NEXT * best];
        let roundings = if even { &near[..] } else { &ROUNDINGS[1..] };
        for &rounding in roundings.iter().filter(|rounding| **rounding >= ROUNDINGS[0]) {
            let recipe = Recipe { rounding, even, ..recipe };
            // A shape that does not fit is none.
            let Ok(candidate) = Candidate::new(goal, recipe) else { continue };
            if candidates.iter().all(|(_, other)| !other.shape.is(&candidate.shape)) {
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
    let share = tried.len() as f64 / (STEPS + tried.len()) as f64;
    let left = time.map(|time| time - time / TIME * tried.len() as u32);
    (candidate, Chosen { choice: Choice::Learning(recipe), bounds: Bounds { steps, time: left }, tried, share })
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
        let Learning { choice, tried, .. } = learning(LEAST_STEPS);
        let recipes: Vec<Recipe> = tried.iter().map(|tried| recipe(tried.choice)).collect();
        let (of_rates, of_shapes) = recipes.split_at(RATES.len());
        assert_eq!(
            of_rates.iter().map(|recipe| (recipe.rate, recipe.rounding)).collect::<Vec<_>>(),
            RATES.map(|r| (r, 1.0))
        );
        let Recipe { rate, .. } = recipe(best(&tried[..RATES.len()], false).expect("a best").choice);
        assert!(!of_shapes.is_empty() && of_shapes.iter().all(|recipe| recipe.rate == rate), "{of_shapes:?}");
        let even = of_shapes.iter().position(|recipe| recipe.even).expect("evened errors are tried");
        let (measured, evened) = of_shapes.split_at(even);
        assert!(measured.iter().all(|of| ROUNDINGS[1..].contains(&of.rounding)), "{measured:?}");
        assert!(evened.len() <= EVEN && evened.iter().all(|of| of.even), "{evened:?}");
        let at_rate: Vec<Tried> = tried.iter().filter(|tried| recipe(tried.choice).rate == rate).copied().collect();
        assert_eq!(best(&at_rate, false).map(|tried| tried.choice), Some(choice));
    }

    #[test]
    fn few_steps_skip_the_trials() {
        let Learning { choice, tried, .. } = learning(20);
        let Recipe { rate, rounding, even, .. } = recipe(choice);
        assert_eq!((rate, rounding, even, tried.len()), (1.0, 1.0, false, 0));
    }
}
