//! Chooses a rival's start and its way of learning, by its error on held-out episodes of the calibration recording.

use actq::calibrate::widening::Widening;
use actq::calibrate::windows::Windows;
use actq::graph::{Graph, Network, Weights};
use actq::methods::distill::train::recorded_error;

use super::fit::{Fit, fit};

/// Divisor of the steps for one trial: as in the method distill.
pub const TRIAL_STEP_DIVISOR: usize = 8;
/// Relative difference of errors that counts as chance: as there.
const CHANCE: f64 = 0.05;

/// Start of learning: weights, and units of their columns.
#[derive(Clone, Debug)]
pub struct Start {
    /// The network.
    pub graph: Graph,
    /// Units of the columns of matrices that read observations.
    pub units: Vec<Option<Vec<f32>>>,
}

/// A choice of a start and of how to learn.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// Index of the start.
    pub start: usize,
    /// Way of learning; its steps are those of a trial.
    pub fit: Fit,
    /// The network that the trial made; `None` without one.
    pub tried: Option<Graph>,
}

/// A choice with its errors on held-out episodes, at the recorded observations and at widened ones.
struct Trial {
    chosen: Chosen,
    recorded: f64,
    widened: f64,
}

/// Tries each start, then each rate with the best start. Every trial learns from three quarters of the episodes, and is
/// measured on the others (`fold`). Without episodes to hold out, the first of both is taken. `progress` receives the
/// share done.
pub fn choose(
    starts: &[Start],
    rates: &[f32],
    by: Fit,
    fold: Option<&(Windows, Windows)>,
    progress: &mut dyn FnMut(f64),
) -> Chosen {
    let first = Fit { steps: by.steps / TRIAL_STEP_DIVISOR, rate: rates.first().copied().unwrap_or(by.rate), ..by };
    let untried = Chosen { start: 0, fit: first, tried: None };
    let Some((learned_from, held_out)) = fold else { return untried };
    let all = starts.len() + rates.len().saturating_sub(1);
    let mut trials: Vec<Trial> = Vec::new();
    let mut attempt = |start: usize, fit_by: Fit, trials: &mut Vec<Trial>| {
        let done = trials.len() as f64;
        let Start { graph, units } = &starts[start];
        let learned = fit(graph, units, learned_from, fit_by, &mut |share| progress((done + share) / all as f64));
        let (network, weights) = (Network::new(&learned), Weights::of(&learned));
        let [recorded, widened] = [None, Some(Widening::WIDE)]
            .map(|widening| recorded_error(&network, &weights, held_out, widening, by.seed));
        trials.push(Trial { chosen: Chosen { start, fit: fit_by, tried: Some(learned) }, recorded, widened });
    };
    let best_of =
        |trials: &[Trial]| lowest_error(trials, held_out.recurrent()).map_or(untried.clone(), |t| t.chosen.clone());
    (0..starts.len()).for_each(|start| attempt(start, first, &mut trials));
    for &rate in rates.iter().skip(1) {
        let best = best_of(&trials);
        attempt(best.start, Fit { rate, ..best.fit }, &mut trials);
    }
    best_of(&trials)
}

/// Returns the trial with the lowest error, by the rule of the method distill. Of those whose errors on the path differ
/// by chance only, it is the one with the lowest error off it. Of a recurrent policy's trials, it is the one with the
/// lowest error off the path.
fn lowest_error(trials: &[Trial], recurrent: bool) -> Option<&Trial> {
    let expected = |trial: &Trial| if recurrent { trial.widened } else { trial.recorded };
    // A trial that diverged has no number for an error.
    let lowest = trials.iter().map(expected).filter(|error| error.is_finite()).min_by(f64::total_cmp)?;
    let alike = trials.iter().filter(|trial| expected(trial) <= (1.0 + CHANCE) * lowest);
    alike.min_by(|a, b| a.widened.total_cmp(&b.widened))
}
