//! The policy's network.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::graph::NodeKind;
use actq::text::printable;

use super::super::common::{known, listed};
use super::feature::Feature;
use super::normalizer::Normalizer;
use crate::bundle::Bundle;
use crate::description::Network;
use crate::facts::Facts;
use crate::sources::Sources as _;

/// An ONNX file whose inputs are features.
pub(super) struct Graph {
    pub(super) file: String,
    inputs: Vec<(String, usize)>,
    pub(super) output: String,
    output_len: usize,
}

impl Graph {
    /// Chooses the file: the only one, or the answer.
    pub(super) fn of(bundle: &Bundle, files: &[String], config: &str, facts: &mut Facts) -> Result<Self> {
        let file = match files {
            [] => bail!(
                "there is no ONNX file; LeRobot saves weights only. Export the network beside {config}, as \
                 docs/families/lerobot.md shows"
            ),
            [only] => {
                facts.note("network", "the only ONNX file");
                only.clone()
            }
            _ => facts.choose_one_of("network", &files.iter().map(String::as_str).collect::<Vec<_>>())?,
        };
        let signature = bundle.signature(&file)?;
        let (inputs, outputs) = (known(&file, &signature.inputs)?, known(&file, &signature.outputs)?);
        let output = match &outputs[..] {
            [only] => Some(only),
            several => several.iter().find(|(name, _)| name == "action"),
        };
        let named = || format!("{file}: none of its outputs is \"action\"; it has {}", listed(&outputs));
        let (output, output_len) = output.with_context(named)?.clone();
        Ok(Self { file, inputs, output, output_len })
    }

    /// Returns the network; each input gets the value with the name `value` of the feature.
    pub(super) fn network(
        &self,
        features: &[Feature],
        frames: usize,
        value: impl Fn(&Feature) -> String,
    ) -> Result<Network> {
        let mut inputs = BTreeMap::new();
        for feature in features {
            let named = |(name, _): &&(String, usize)| *name == feature.name || *name == feature.plain();
            let input = match (&self.inputs[..], features) {
                ([only], [_]) => Some(only),
                _ => self.inputs.iter().find(named),
            };
            let (name, len) = input.with_context(|| {
                format!(
                    "{}: no input is called {:?} or {:?}; it has {}; export with input_names",
                    self.file,
                    printable(&feature.name),
                    printable(&feature.plain()),
                    listed(&self.inputs)
                )
            })?;
            if *len != frames * feature.len {
                return Err(Facts::contradiction(
                    &format!("length of {:?}", printable(&feature.name)),
                    (&feature.at, &format!("{} values in {frames} observations", frames * feature.len)),
                    (&format!("{}: input {:?}", self.file, printable(name)), &format!("{len} values")),
                ));
            }
            inputs.insert(name.clone(), value(feature));
        }
        let other = self.inputs.iter().find(|(name, _)| !inputs.contains_key(name));
        ensure!(
            other.is_none(),
            "{}: input {:?} matches none of the features {}; export without it",
            self.file,
            printable(other.map_or("", |(name, _)| name)),
            features.iter().map(|feature| printable(&feature.name)).collect::<Vec<_>>().join(", ")
        );
        Ok(Network { name: "policy".to_owned(), file: self.file.clone(), inputs, states: [].into() })
    }

    /// Compares the output with the action.
    pub(super) fn check_output(&self, action: &Feature) -> Result<()> {
        let (output, len) = (printable(&self.output), self.output_len);
        if len == action.len {
            return Ok(());
        }
        ensure!(
            len % action.len != 0,
            "{}: output {output:?} has {len} values, a chunk of {} actions of {}, and an image gives one action a tick; export \
             the first action of the chunk, as docs/families/lerobot.md shows",
            self.file,
            len / action.len,
            action.len
        );
        Err(Facts::contradiction(
            "length of the action",
            (&action.at, &format!("{} values", action.len)),
            (&format!("{}: output {output:?}", self.file), &format!("{len} values")),
        ))
    }

    /// Refuses a graph that normalizes an observation or the action itself.
    pub(super) fn refuse_normalizers(
        &self,
        bundle: &Bundle,
        network: &Network,
        observations: &[Normalizer],
        action: &Normalizer,
    ) -> Result<()> {
        let opened = bundle.network(network, std::slice::from_ref(&self.output))?;
        let Some(part) = opened.part(0) else { return Ok(()) };
        let twice = |normalizer: &Normalizer, what: &str| {
            Facts::contradiction(
                "normalization",
                (&normalizer.source, "that it is outside of the network"),
                (&self.file, &format!("that the graph {what} with the same numbers; export the network alone")),
            )
        };
        for node in &part.policy.graph.nodes {
            let NodeKind::Normalize(node) = &node.kind else { continue };
            let numbers = |list: &[f32]| list.iter().copied().map(f64::from).collect::<Vec<_>>();
            let (mean, scale) = (numbers(&node.mean), numbers(&node.scale));
            if let Some(normalizer) = observations.iter().find(|normalizer| normalizer.is_in(&mean, &scale)) {
                return Err(twice(normalizer, "normalizes"));
            }
        }
        let contract = &part.policy.contract;
        let list = |list: &Option<Vec<f32>>, other: f32| {
            let list = list.clone().unwrap_or_else(|| vec![other; part.policy.act_len]);
            list.into_iter().map(f64::from).collect::<Vec<_>>()
        };
        if action.is_reversed_by(&list(&contract.scale, 1.0), &list(&contract.offset, 0.0)) {
            return Err(twice(action, "reverses it"));
        }
        Ok(())
    }
}
