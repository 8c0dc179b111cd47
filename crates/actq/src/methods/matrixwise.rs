//! Methods that quantize every matrix separately and to one width: round to nearest, and GPTQ. A budget widens matrices
//! greedily.

use actq_kernels::Width;
use actq_kernels::image::block_bytes;

use super::options::Options;
use super::quantized::{Outcome, Quantized};
use super::{gptq, scale};
use crate::budget::{BudgetTooSmall, Rate};
use crate::calibrate::moments::Moments;
use crate::error::Result;
use crate::graph::{Graph, WeightMatrix};

/// Quantizes every matrix of `graph`: by error feedback with the `moments` of its input, if given, or by rounding to
/// nearest.
pub fn quantize(graph: &Graph, moments: Option<&[Moments]>, rate: Rate, options: &Options) -> Result<Vec<Outcome>> {
    let one = |m: usize, width| -> Result<Outcome> {
        let matrix: &WeightMatrix = &graph.matrices[m];
        let moments = moments.map(|moments| &moments[m]);
        let quantized: Quantized = match moments {
            None => scale::round_to_nearest(matrix, width, options.group),
            Some(moments) => gptq::quantize(matrix, width, options.group, moments)?,
        };
        Outcome::new(matrix, quantized, moments, options.activations)
    };
    let indexes = 0..graph.matrices.len();
    match rate {
        Rate::Width(width) => indexes.map(|m| one(m, width)).collect(),
        Rate::BitsPerWeight(_) | Rate::Bytes(_) | Rate::Within { .. } => {
            let tries: Vec<Vec<Outcome>> =
                indexes.map(|m| Width::ALL.into_iter().map(|width| one(m, width)).collect()).collect::<Result<_>>()?;
            let chosen = allocate(&tries, rate.bytes(graph.weights()), graph.weights())?;
            Ok(tries.into_iter().zip(chosen).map(|(mut tries, choice)| tries.swap_remove(choice)).collect())
        }
    }
}

/// Returns the fewest bytes that the matrices of `graph` take.
pub(super) fn least_bytes(graph: &Graph, options: &Options) -> usize {
    let packing = options.packing();
    let at = |m: &WeightMatrix, width| block_bytes(packing.shape(width, m.rows, m.cols), false);
    let least = |m: &WeightMatrix| Width::ALL.into_iter().map(|width| at(m, width)).min().unwrap_or(0);
    graph.matrices.iter().map(least).sum()
}

/// Selects one of each matrix's tries so that the bytes stay within `limit`. It starts from the smallest, and
/// repeatedly makes the change that most lowers the sum of relative errors per byte and still fits. (A wider try can
/// take fewer bytes if it pads less.)
fn allocate(tries: &[Vec<Outcome>], limit: f64, weights: usize) -> Result<Vec<usize>> {
    let size = |m: usize, choice: usize| tries[m][choice].bytes();
    let error = |m: usize, choice: usize| tries[m][choice].error.unwrap_or(0.0);
    let smallest = |m: usize| (0..tries[m].len()).min_by_key(|&choice| size(m, choice)).unwrap_or(0);
    let mut chosen: Vec<usize> = (0..tries.len()).map(smallest).collect();
    let mut bytes: usize = chosen.iter().enumerate().map(|(m, &choice)| size(m, choice)).sum();
    BudgetTooSmall::check(bytes, limit, weights)?;
    loop {
        let mut best: Option<(f64, usize, usize, usize)> = None;
        for m in 0..tries.len() {
            for choice in 0..tries[m].len() {
                let after = bytes - size(m, chosen[m]) + size(m, choice);
                let gain = error(m, chosen[m]) - error(m, choice);
                let rate = gain / after.saturating_sub(bytes).max(1) as f64;
                if after as f64 <= limit && gain > 0.0 && best.is_none_or(|(known, ..)| rate > known) {
                    best = Some((rate, m, choice, after));
                }
            }
        }
        let Some((_, m, choice, after)) = best else { return Ok(chosen) };
        (chosen[m], bytes) = (choice, after);
    }
}
