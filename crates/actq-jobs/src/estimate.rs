//! Estimates of a job's time and memory, from the network's size alone. A record of `docs/SCALE.md` has the
//! measurements on which they rest.

use actq::graph::Graph;
use actq::methods::distill::schedule::most_steps;
use actq::methods::{Effort, Method};

/// Seconds of a job that does almost nothing: the start of the process, and reading.
const MIN_SECONDS: f64 = 0.02;
/// Seconds per weight of rounding and packing, of these with statistics of a recording, and of two-sided error
/// feedback.
const ROUNDING: f64 = 3e-6;
const STATISTICS: f64 = 7e-6;
const FEEDBACK: f64 = 2.6e-5;
/// Seconds per weight of a step of distillation, on one core: between 3.1e-8 if most rows are removed and 7e-8 if none
/// is. Removed rows count, though most steps do not compute them.
const STEP: f64 = 5e-8;
/// Seconds per weight of one observation, in the executor on a host.
const OBSERVATION: f64 = 2e-10;

/// Bytes of a process, and bytes per weight of learning.
const PROCESS: u64 = 32 << 20;
const WEIGHT: u64 = 160;
/// Copies of the recording's bytes in memory.
const RECORDINGS: u64 = 4;

/// Returns the seconds of a job that quantizes.
pub fn quantize_seconds(graph: &Graph, method: &Method, steps: Option<usize>, effort: Effort) -> f64 {
    let weights = graph.weights() as f64;
    let work = match method {
        Method::Rtn => ROUNDING,
        Method::Distill => {
            let steps = steps.unwrap_or_else(|| most_steps(graph, effort));
            if steps == 0 { FEEDBACK } else { STATISTICS + steps as f64 * STEP }
        }
        Method::Gptq | Method::Custom(_) => STATISTICS,
    };
    MIN_SECONDS + weights * work
}

/// Returns the seconds of a measurement on this many observations.
pub fn evaluate_seconds(graph: &Graph, observations: usize) -> f64 {
    MIN_SECONDS + graph.weights() as f64 * graph.denoising_steps().max(1) as f64 * observations as f64 * OBSERVATION
}

/// Returns the memory of a job, in MiB, with `recordings` bytes of recordings.
pub fn memory_mib(graph: &Graph, recordings: u64) -> u64 {
    (PROCESS + WEIGHT * graph.weights() as u64 + RECORDINGS * recordings) >> 20
}

/// Returns the seconds of a job that merges this many results.
pub fn merge_seconds(results: usize) -> f64 {
    MIN_SECONDS + 1e-4 * results as f64
}
