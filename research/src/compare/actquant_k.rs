//! ActQuant in the block formats of its paper, llama.cpp's K-quants and IQ2_XS, simulated.
//!
//! The costs that this project's own kernels would add are excluded, in its favour: activations stay in f32, and
//! padding to whole super-blocks is not counted.

use std::fs;

use actq::budget::Rate;
use actq::data::Dataset;
use actq::graph::Graph;
use actq::import::FILES;
use actq::measure::eval;
use actq::policy::Policy;
use anyhow::{Context as _, Result, ensure};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

use crate::actquant::{self, ActionStatistics, allocation};
use crate::kquants::Format;

/// A network with the weights that its codes and scales represent.
pub(super) struct Simulated {
    /// The network.
    pub(super) graph: Graph,
    /// Its error on the held-out recording.
    pub(super) nmse: f64,
    /// The format of each matrix.
    pub(super) formats: Vec<Format>,
    /// Bytes of all matrices.
    pub(super) bytes: usize,
}

/// Chooses formats by ActQuant's scores and its allocation, scales by the Fisher importance.
///
/// Some choices are made in the rival's favour, by the lowest held-out error:
///
/// - The paper has models from Q2_K on and from IQ2_XS on. From Q2_K, the bits of a format's expected error are those
///   of a code, as [elsewhere](crate::actquant::choices::NoiseBits). IQ2_XS and Q2_K have equally many of them. So
///   from IQ2_XS, all bits of the format count, as in the authors' code.
/// - llama.cpp's search also multiplies the importance by the weights' magnitude; the paper's objective does not.
///
/// # Errors
///
/// [`actq::budget::BudgetTooSmall`] if IQ2_XS everywhere exceeds the budget.
pub(super) fn quantize(
    graph: &Graph,
    statistics: &ActionStatistics,
    budget: f64,
    heldout: &Dataset,
) -> Result<Simulated> {
    let code_bits = |format: Format| f64::from(format.bits());
    let mut allocations = vec![allocate(graph, statistics, budget, &Format::ALL, Format::bits_per_weight)?];
    match allocate(graph, statistics, budget, &Format::K_QUANTS, code_bits) {
        Ok(formats) if formats != allocations[0] => allocations.push(formats),
        Err(error) if error.budget().is_none() => return Err(error.into()),
        _ => {}
    }
    let mut best: Option<Simulated> = None;
    for formats in allocations {
        for by_magnitude in [false, true] {
            let found = simulate(graph, statistics, &formats, by_magnitude, heldout)?;
            if best.as_ref().is_none_or(|best| found.nmse.total_cmp(&best.nmse).is_lt()) {
                best = Some(found);
            }
        }
    }
    best.context("no allocation was tried")
}

/// Allocates a format per matrix, of `formats` from few bits to many. `bits` returns the bits of a format's expected
/// error.
fn allocate(
    graph: &Graph,
    statistics: &ActionStatistics,
    budget: f64,
    formats: &[Format],
    bits: impl Fn(Format) -> f64,
) -> actq::error::Result<Vec<Format>> {
    let size = |matrix: usize, choice: usize| formats[choice].bytes(graph.matrices[matrix].data.len());
    let limit = Rate::BitsPerWeight(budget).bytes(graph.weights());
    let scores = statistics.effective_scores().0;
    let all = vec![0..formats.len(); graph.matrices.len()];
    let chosen = allocation::spend(graph, &scores, &all, |_, choice| bits(formats[choice]), size, limit)?;
    Ok(chosen.into_iter().map(|choice| formats[choice]).collect())
}

fn simulate(
    graph: &Graph,
    statistics: &ActionStatistics,
    formats: &[Format],
    by_magnitude: bool,
    heldout: &Dataset,
) -> Result<Simulated> {
    let mut graph = graph.clone();
    let importance = statistics.weight_importance(&graph);
    let mut bytes = 0;
    for ((matrix, format), mut importance) in graph.matrices.iter_mut().zip(formats).zip(importance) {
        if by_magnitude {
            importance = actquant::by_magnitude(importance, matrix);
        }
        bytes += format.bytes(matrix.data.len());
        matrix.data = format.rounded(&matrix.data, matrix.cols, &importance);
    }
    Ok(Simulated { nmse: eval::network_nmse(&graph, heldout)?, graph, formats: formats.to_vec(), bytes })
}

/// Returns the policy's file of tensors with the matrices of `graph`.
pub(super) fn tensors(policy: &Policy, graph: &Graph) -> Result<Vec<u8>> {
    let [_, tensors] = FILES;
    let path = policy.dir.join(tensors);
    let bytes = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let source = SafeTensors::deserialize(&bytes).with_context(|| format!("{}: {tensors}", policy.dir.display()))?;
    let mut replaced = Vec::new();
    for (before, after) in policy.graph.matrices.iter().zip(&graph.matrices) {
        let name = before.name.as_str();
        let view = source.tensor(name).with_context(|| format!("{tensors} has no tensor {name}"))?;
        let is_same = view.dtype() == Dtype::F32
            && view
                .data()
                .chunks_exact(4)
                .map(|b| [b[0], b[1], b[2], b[3]])
                .eq(before.data.iter().map(|w| w.to_le_bytes()));
        ensure!(is_same, "cannot replace tensor {name}: it differs from the matrix in use");
        let data: Vec<u8> = after.data.iter().flat_map(|w| w.to_le_bytes()).collect();
        replaced.push((name, view.shape().to_vec(), data));
    }
    let mut views: Vec<(&str, TensorView<'_>)> =
        source.iter().filter(|(name, _)| replaced.iter().all(|(replaced, ..)| replaced != name)).collect();
    for (name, shape, data) in &replaced {
        views.push((name, TensorView::new(Dtype::F32, shape.clone(), data)?));
    }
    Ok(safetensors::serialize(views, None)?)
}
