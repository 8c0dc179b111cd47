//! ActQuant in the block formats of its paper, llama.cpp's K-quants, simulated.
//!
//! The costs that this project's own kernels would add are excluded, in its favour: activations stay in f32, and
//! padding to whole super-blocks is not counted.

use std::fs;
use std::path::Path;

use actq::budget::Rate;
use actq::data::Dataset;
use actq::graph::Graph;
use actq::import::FILES;
use actq::measure::eval;
use actq::policy::Policy;
use actq_cli::outputs::files;
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
/// llama.cpp's search also multiplies the importance by the weights' magnitude; the paper's objective does not. This
/// function tries both, and takes the one with the lower held-out error: a choice in the rival's favour.
///
/// # Errors
///
/// [`actq::budget::BudgetTooSmall`] if two bits everywhere exceed the budget.
pub(super) fn quantize(
    graph: &Graph,
    statistics: &ActionStatistics,
    budget: f64,
    heldout: &Dataset,
) -> Result<Simulated> {
    let size = |matrix: usize, choice: usize| Format::ALL[choice].bytes(graph.matrices[matrix].data.len());
    let limit = Rate::BitsPerWeight(budget).bytes(graph.weights());
    let scores = statistics.effective_scores().0;
    let all = vec![0..Format::ALL.len(); graph.matrices.len()];
    let bits = |_: usize, choice: usize| f64::from(Format::ALL[choice].bits());
    let chosen = allocation::spend(graph, &scores, &all, bits, size, limit)?;
    let bytes = chosen.iter().enumerate().map(|(matrix, &choice)| size(matrix, choice)).sum();
    let formats: Vec<Format> = chosen.into_iter().map(|choice| Format::ALL[choice]).collect();
    let tries = [false, true].map(|by_magnitude| -> Result<(f64, Graph)> {
        let mut graph = graph.clone();
        let importance = statistics.weight_importance(&graph);
        for ((matrix, format), mut importance) in graph.matrices.iter_mut().zip(&formats).zip(importance) {
            if by_magnitude {
                importance = actquant::by_magnitude(importance, matrix);
            }
            matrix.data = format.rounded(&matrix.data, matrix.cols, &importance);
        }
        Ok((eval::network_nmse(&graph, heldout)?, graph))
    });
    let [plain, by_magnitude] = tries;
    let (plain, by_magnitude) = (plain?, by_magnitude?);
    let (nmse, graph) = if by_magnitude.0 < plain.0 { by_magnitude } else { plain };
    Ok(Simulated { graph, nmse, formats, bytes })
}

/// Writes the policy with the matrices of `graph` into a folder of its own.
pub(super) fn write_policy(policy: &Policy, graph: &Graph, folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let [json, tensors] = FILES;
    let read = |name: &str| {
        let path = policy.dir.join(name);
        fs::read(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let bytes = read(tensors)?;
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
    files::write(&folder.join(tensors), &safetensors::serialize(views, None)?)?;
    files::write(&folder.join(json), &read(json)?)
}
