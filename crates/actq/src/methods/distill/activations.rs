//! Choice between int8 and int16 activations for each matrix.

use actq_kernels::Width;
use ndarray::Array2;

use super::allocate::{Rows, allocate};
use super::dimension::Widths;
use super::size::Size;
use super::train::losses;
use crate::calibrate::allowance::Allowance;
use crate::calibrate::windows::{Batch, Windows};
use crate::error::Result;
use crate::graph::{Graph, Network};
use crate::methods::options::Options;
use crate::methods::packing::{Activations, Packing};
use crate::methods::quantized::{Quantized, dequantized};
use crate::random::Random;

/// Least share of the error that an int16 input must remove, and the addition per share of the weights: its kernel
/// takes 1.3 to 1.7 times as long.
const MIN_ERROR_SHARE: f32 = 0.03;
const EXTRA_SHARE_PER_WEIGHT_SHARE: f32 = 0.12;
/// Ratio of bytes, int8 layout over int16 layout, above which a matrix of few columns and mostly 8-bit rows gets int16.
/// Columns are padded to 8 in int8, to 4 in int16.
const MIN_PADDING_RATIO: f64 = 1.15;
/// Divisor of all weights; a small matrix has at most this share.
const SMALL_DIVISOR: usize = 10;
const INT8: u16 = Activations::Int8.limit();
const INT16: u16 = Activations::Int16.limit();
/// Batches that the choice is measured on, and samples in each.
const ERROR_BATCHES: usize = 8;
const BATCH_SAMPLES: usize = 256;

/// Allocates widths for all rows, and the activations' magnitudes of learning. These are int8 unless requested
/// otherwise, or int16 if it takes so many fewer bytes that other rows can use them. `size` does not reserve room for
/// any layout yet.
pub(super) fn allocated(size: Size<'_>, rows: &[Rows], options: &Options, allowed: f64) -> Result<(Widths, Vec<u16>)> {
    let requested = vec![options.activations.limit(); size.graph.matrices.len()];
    let within = |limits: &[u16]| {
        let size = Size { packings: reserved_packings(size.graph, limits, options), ..size.clone() };
        allocate(&size, rows, allowed)
    };
    let Ok(widths) = within(&requested) else { return allocated_in_smallest_layouts(size, rows, options, allowed) };
    let takes = |m: usize, limit: u16| size.matrix(&widths, m, Packing::of(limit, options.group)) as f64;
    let limit = |(m, &limit): (usize, &u16)| match options.activations.are_asked_for() {
        false if takes(m, INT8) >= MIN_PADDING_RATIO * takes(m, INT16) => INT16,
        _ => limit,
    };
    let limits: Vec<u16> = requested.iter().enumerate().map(limit).collect();
    if limits == requested {
        return Ok((widths, limits));
    }
    Ok(within(&limits).map_or((widths, requested), |widths| (widths, limits)))
}

/// Does the same if there is room for one layout only: the one that can take the fewest bytes.
fn allocated_in_smallest_layouts(
    size: Size<'_>,
    rows: &[Rows],
    options: &Options,
    allowed: f64,
) -> Result<(Widths, Vec<u16>)> {
    let forced: Vec<Option<Width>> = rows.iter().map(|rows| rows.forced).collect();
    let limits = smallest_limits(&size, options, &forced);
    let widths = allocate(&Size { packings: packed(&limits, options), ..size }, rows, allowed)?;
    Ok((widths, limits))
}

/// Returns the fewest bytes of a network, all that `size` counts.
pub(super) fn least_bytes(size: &Size<'_>, options: &Options, forced: &[Option<Width>]) -> usize {
    let limits = smallest_limits(size, options, forced);
    let size = Size { packings: packed(&limits, options), ..size.clone() };
    size.bytes(&size.smallest(forced))
}

/// Returns the activations' magnitude of every matrix with which it can take the fewest bytes.
fn smallest_limits(size: &Size<'_>, options: &Options, forced: &[Option<Width>]) -> Vec<u16> {
    let requested = vec![options.activations.limit(); forced.len()];
    if options.activations.are_asked_for() {
        return requested;
    }
    let least = |m: usize, limit: u16| {
        let mut limits = requested.clone();
        limits[m] = limit;
        let size = Size { packings: packed(&limits, options), ..size.clone() };
        size.bytes(&size.smallest(forced))
    };
    (0..forced.len()).map(|m| if least(m, INT16) < least(m, INT8) { INT16 } else { INT8 }).collect()
}

/// Returns the layouts of these magnitudes.
pub(super) fn packed(limits: &[u16], options: &Options) -> Vec<Vec<Packing>> {
    limits.iter().map(|&limit| vec![Packing::of(limit, options.group)]).collect()
}

/// Returns the layouts for which bytes are reserved: that of every matrix's limit, and int16 for undecided matrices
/// that are likely to need it, such as the first and the last layer.
fn reserved_packings(graph: &Graph, limits: &[u16], options: &Options) -> Vec<Vec<Packing>> {
    let mut packings = packed(limits, options);
    for ((matrix, packings), limit) in graph.matrices.iter().zip(&mut packings).zip(limits) {
        let open = !options.activations.are_asked_for() && *limit == INT8;
        if open && SMALL_DIVISOR * matrix.data.len() <= graph.weights() {
            packings.push(Packing::of(INT16, options.group));
        }
    }
    packings
}

/// Chooses int16 for each matrix whose input, rounded to int8, adds more to the error than int16 costs in time; the
/// others keep their least magnitude.
pub fn choose_activations(
    graph: &Graph,
    quantized: &[Quantized],
    windows: &Windows,
    least: &[u16],
    allowance: Option<Allowance>,
    seed: u64,
) -> Vec<u16> {
    let weights = dequantized(graph, quantized);
    let samples = (BATCH_SAMPLES / windows.window).max(8);
    let taught: Vec<(Batch, Array2<f32>)> =
        (0..ERROR_BATCHES as u64).map(|i| windows.taught_batch(samples, None, &mut Random::new(seed + i))).collect();
    let error = |x_max: &[u16], measured: usize| -> f32 {
        let network = Network::rounded(graph, x_max);
        losses(&network, &weights, windows, taught[..measured].iter().cloned()).sum()
    };
    let choices = 1 + quantized.len();
    let measured = allowance.map_or(ERROR_BATCHES, |allowance| {
        let batches = allowance.fits(1, || _ = error(least, 1), choices, choices * ERROR_BATCHES);
        batches / choices
    });
    let before = error(least, measured);
    let weights_of = |q: &Quantized| (q.rows * q.cols) as f32;
    let all: f32 = quantized.iter().map(weights_of).sum();
    (0..quantized.len())
        .map(|m| {
            if least[m] == INT16 {
                return INT16;
            }
            let mut x_max = least.to_vec();
            x_max[m] = INT16;
            let least_share = MIN_ERROR_SHARE + EXTRA_SHARE_PER_WEIGHT_SHARE * weights_of(&quantized[m]) / all;
            if before - error(&x_max, measured) > least_share * before { INT16 } else { least[m] }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use crate::graph::WeightMatrix;
    use crate::methods::Method;

    #[test]
    fn int16_is_taken_if_int8_pads_more() {
        let mut graph = Graph::new(18);
        for cols in [18, 320] {
            graph.matrices.push(WeightMatrix { name: "m".into(), rows: 64, cols, data: vec![0.0; 64 * cols] });
        }
        let size = Size::new(&graph, &[], 0);
        let rows = |energy: f64| Rows { energy: vec![energy; 64], removal: vec![1e9; 64], rounding: 1.0, forced: None };
        let limits = |of_first: f64, activations: Activations| {
            let plain = Options::new(Method::Distill, Budget::BitsPerWeight(4.0));
            let options = Options { activations, ..plain };
            let allowed = 0.5 * graph.weights() as f64;
            let found = allocated(size.clone(), &[rows(of_first), rows(1.0)], &options, allowed).expect("it fits");
            (found.0[0][0], found.1)
        };
        assert_eq!(limits(1e6, Activations::Auto), (Some(Width::W8), vec![INT16, INT8]));
        assert_eq!(
            limits(1e-6, Activations::Auto),
            (Some(Width::W2), vec![INT8, INT8]),
            "2 bits are padded less in int8"
        );
        assert_eq!(limits(1e6, Activations::Int8), (Some(Width::W8), vec![INT8, INT8]));
        assert_eq!(limits(1e6, Activations::Int16), (Some(Width::W8), vec![INT16, INT16]));
    }
}
