//! How far the inputs are widened, chosen by leaving whole episodes out.
//!
//! Each choice learns for an eighth of the steps from three quarters of the episodes. On the others its error is measured twice, at
//! the recorded observations and at widened ones. A feed-forward network takes the choice with the lowest error at the recorded
//! observations, a recurrent one that with the lowest geometric mean of both: the error on the recorded path alone would always
//! take the least noise, with which a recurrent policy that balances falls (docs/QUANTIZER.md).

use std::time::Duration;

use super::distill::{Learned, Task, distill, loss};
use super::schedule::Bounds;
use crate::calibrate::widening::Widening;
use crate::calibrate::windows::Windows;
use crate::graph::Network;
use crate::methods::learning::Tried;
use crate::methods::quantized::dequantized;
use crate::random::Random;

/// With fewer steps there is nothing to share.
const LEAST_STEPS: usize = 3000;
/// Of the steps, and of the time, for one choice.
const STEPS: usize = 8;
const TIME: u32 = 12;
/// What is left of the time for learning.
const TIME_LEFT: f64 = 0.75;
/// Of all the work, roughly.
pub const CHOOSING: f64 = 0.27;
/// Batches that an error is measured on, and frames in each.
const BATCHES: usize = 16;
const FRAMES: usize = 512;

/// Tries all choices and gives the best in `task`, with what is left of the time. With few steps, or where no episode can be left
/// out, nothing is tried.
pub fn choose<'a>(
    task: &Task<'a>,
    windows: &Windows<'_>,
    mut progress: impl FnMut(f64, f64),
) -> (Task<'a>, Vec<Tried>) {
    let Bounds { steps, time } = task.bounds;
    let parts = windows.split().filter(|_| steps.is_none_or(|steps| steps >= LEAST_STEPS));
    let Some((learned_from, left_out)) = parts else { return (task.clone(), Vec::new()) };
    let bounds = Bounds { steps: steps.map(|steps| steps / STEPS), time: time.map(|time| time / TIME) };
    let choices = Widening::CHOICES;
    let of = |(i, &widening): (usize, &Widening)| {
        let task = Task { widening, bounds, ..task.clone() };
        let learned = distill(&task, &learned_from, |share, error| {
            progress((i as f64 + share) / choices.len() as f64, error);
        });
        let [recorded, widened] = errors(&task, &learned, &left_out);
        Tried { widening, recorded, widened }
    };
    let tried: Vec<Tried> = choices.iter().enumerate().map(of).collect();
    let decides = |tried: &Tried| match windows.recurrent() {
        true => (tried.recorded * tried.widened).sqrt(),
        false => tried.recorded,
    };
    let best = tried.iter().min_by(|a, b| decides(a).total_cmp(&decides(b)));
    let widening = best.map_or(task.widening, |best| best.widening);
    let left = time.map(|time| Duration::from_secs_f64(time.as_secs_f64() * TIME_LEFT));
    (Task { widening, bounds: Bounds { steps, time: left }, ..task.clone() }, tried)
}

/// The errors of what was learned, at recorded and at widened observations, the same for every choice.
fn errors(task: &Task<'_>, learned: &Learned, windows: &Windows<'_>) -> [f64; 2] {
    let network = Network::rounded(&learned.graph, task.x_max);
    let weights = dequantized(&learned.graph, &learned.quantized);
    let size = (FRAMES / windows.window).max(1);
    [None, Some(Widening::WIDE)].map(|widening| {
        let mut random = Random::new(task.seed);
        let batches = (0..BATCHES).map(|_| windows.batch(size, widening, &mut random));
        batches.map(|batch| f64::from(loss(&network, &weights, windows, batch))).sum::<f64>() / BATCHES as f64
    })
}
