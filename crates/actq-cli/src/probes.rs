//! Observations drawn to compare a policy with what it was imported from.

use actq::graph::ops::Normalize;
use actq::graph::{Graph, NodeKind};
use actq::policy::Policy;
use actq::random::Random;
use actq_onnx::Imported;

/// Draws `frames` observations for each magnitude: around 0, and in a second round around the means of the policy's own
/// normalizers, if it has one. Of 8 successive ones, one has no negative value, one no positive value, and one is the
/// middle. Inputs that the file takes as integers are rounded. Noise follows if the policy makes its actions of it.
pub fn probes(imported: &Imported, policy: &Policy, magnitudes: &[f32], frames: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(1);
    let whole = |(name, len): &(String, usize)| vec![imported.integers.contains(name); *len];
    let mut whole: Vec<bool> = imported.inputs.iter().flat_map(whole).collect();
    // A prefix follows the observation.
    whole.resize(whole.len() + policy.graph.prefix_len, false);
    let plain = vec![(0.0, 1.0); whole.len()];
    let normalized = normalizers(&policy.graph);
    let rounds = if normalized == plain { vec![plain] } else { vec![plain, normalized] };
    let mut drawn = Vec::new();
    for (units, magnitude) in rounds.iter().flat_map(|units| magnitudes.iter().map(move |magnitude| (units, magnitude)))
    {
        for i in 0..frames {
            let mut value = |((mean, deviation), is_whole): (&(f32, f32), &bool)| {
                let unit = magnitude * random.unit();
                let unit = match i % 8 {
                    5 => unit.abs(),
                    6 => -unit.abs(),
                    7 => 0.0,
                    _ => unit,
                };
                let value = mean + deviation * unit;
                if *is_whole { (100.0 * value).round() } else { value }
            };
            let mut one: Vec<f32> = units.iter().zip(&whole).map(&mut value).collect();
            one.extend((0..policy.graph.noise_len()).map(|_| random.normal()));
            drawn.push(one);
        }
    }
    drawn
}

/// Returns mean and deviation of each observed value, as the first normalizer that reads it has them; 0 and 1 without
/// one.
fn normalizers(graph: &Graph) -> Vec<(f32, f32)> {
    let mut units: Vec<Option<(f32, f32)>> = vec![None; graph.obs_len];
    // For each value, the observed values that it consists of.
    let mut places: Vec<Option<Vec<usize>>> = vec![Some((0..graph.obs_len).collect())];
    for node in &graph.nodes {
        let observed = match &node.kind {
            NodeKind::Concat(concat) => {
                let parts = node.inputs.iter().zip(&concat.0);
                let part = |(&input, span): (&usize, &actq::graph::ops::Span)| {
                    places[input].as_ref().map(|all| all[span.from..span.from + span.len].to_vec())
                };
                parts.map(part).collect::<Option<Vec<_>>>().map(|parts| parts.concat())
            }
            NodeKind::Normalize(Normalize { mean, scale, .. }) => {
                for (&place, (mean, scale)) in places[node.inputs[0]].iter().flatten().zip(mean.iter().zip(scale)) {
                    let deviation = scale.recip().abs();
                    if deviation.is_finite() && units[place].is_none() {
                        units[place] = Some((*mean, deviation));
                    }
                }
                None
            }
            _ => None,
        };
        places.push(observed);
    }
    units.into_iter().map(|unit| unit.unwrap_or((0.0, 1.0))).collect()
}
