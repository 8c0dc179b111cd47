//! Estimates of a job's time and memory, from the network's size alone. `docs/SCALE.md` compares them with measurements.

use actq::graph::Graph;
use actq::methods::Method;

use crate::spec::Spec;

/// Seconds of a job that does almost nothing: the start of the process, and reading.
const LEAST_SECONDS: f64 = 0.1;
/// Seconds of a weight: rounding and packing it, and with a recording its statistics.
const ROUNDING: f64 = 1e-6;
const STATISTICS: f64 = 2e-5;
/// Seconds of a weight in a step of distillation, on one core.
const STEP: f64 = 4e-8;
/// Seconds of a weight for one observation, in the executor on a host.
const OBSERVATION: f64 = 2e-9;

/// Bytes of a process, and bytes of a weight while it learns.
const PROCESS: u64 = 64 << 20;
const WEIGHT: u64 = 256;
/// Copies of the recording's bytes in memory.
const RECORDINGS: u64 = 4;

/// Returns the seconds of a job that makes an image.
pub(crate) fn making(graph: &Graph, method: &Method, spec: &Spec) -> f64 {
    let weights = graph.weights() as f64;
    let work = match method {
        Method::Rtn => ROUNDING,
        Method::Distill => {
            let steps = spec.steps.unwrap_or_else(|| actq::methods::distill::schedule::most_steps(graph));
            STATISTICS + steps as f64 * STEP
        }
        Method::Gptq | Method::Custom(_) => STATISTICS,
    };
    LEAST_SECONDS + weights * work
}

/// Returns the seconds of a measurement on this many observations.
pub(crate) fn evaluating(graph: &Graph, observations: usize) -> f64 {
    LEAST_SECONDS + graph.weights() as f64 * graph.denoising_steps().max(1) as f64 * observations as f64 * OBSERVATION
}

/// Returns the memory of a job, in MiB, with `recordings` bytes of recordings.
pub(crate) fn memory_mib(graph: &Graph, recordings: u64) -> u64 {
    (PROCESS + WEIGHT * graph.weights() as u64 + RECORDINGS * recordings) >> 20
}

/// Seconds of a job that merges this many results.
pub(crate) fn merging(results: usize) -> f64 {
    LEAST_SECONDS + 1e-4 * results as f64
}
