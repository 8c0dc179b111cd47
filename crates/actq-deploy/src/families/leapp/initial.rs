//! First values of inputs that are fed back.

use std::collections::{BTreeMap, BTreeSet};

use actq::error::{Result, ensure};
use actq::import::values::Tensor;
use actq::text::printable;

use super::model::{Model, Port};
use super::pipeline::{Pipeline, Source};
use crate::bundle::{Bundle, beside};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::tensors::{finite, tensors};
use crate::yaml::Node;

/// The tensors of `pipeline.initial_values`, by `MODEL/INPUT`.
#[derive(Default)]
pub(super) struct Initial {
    file: String,
    tensors: BTreeMap<String, Tensor>,
}

impl Initial {
    pub(super) fn of(bundle: &Bundle, yaml: &Document, models: &[Model], pipeline: &Pipeline) -> Result<Self> {
        let key = "pipeline.initial_values";
        let Some(name) = yaml.optional(key, "the name of a file", Node::text)? else { return Ok(Self::default()) };
        let file = beside(&yaml.file, name);
        let tensors = tensors(bundle, &file, |_| true)?;
        let mut fed_back = BTreeSet::new();
        for (i, model) in models.iter().enumerate() {
            let inputs = model.inputs.iter().enumerate();
            let inputs = inputs.filter(|(input, _)| matches!(pipeline.source((i, *input)).0, Source::Before(_)));
            fed_back.extend(inputs.map(|(_, port)| key_of(model, port)));
        }
        let other = tensors.keys().find(|key| !fed_back.contains(*key));
        ensure!(
            other.is_none(),
            "{file}: {:?} is not an input that pipeline.feedback_flow names; export the pipeline again",
            printable(other.map_or("", String::as_str))
        );
        Ok(Self { file, tensors })
    }

    /// Returns the first values of an input, and where they are from.
    pub(super) fn start(&self, model: &Model, port: &Port, facts: &mut Facts) -> Result<(Vec<f64>, String)> {
        let key = key_of(model, port);
        let Some(tensor) = self.tensors.get(&key) else {
            let start: f64 = facts.value_or_default("state.start")?;
            return Ok((vec![start; port.len], facts.source("state.start")));
        };
        let at = format!("{}: {}", self.file, printable(&key));
        if tensor.shape != port.shape {
            return Err(Facts::contradiction(
                &format!("shape of {:?}", printable(&port.name)),
                (&port.at, &format!("{:?}", port.shape)),
                (&at, &format!("{:?}", tensor.shape)),
            ));
        }
        Ok((finite(tensor, &at)?, at))
    }
}

fn key_of(model: &Model, port: &Port) -> String {
    format!("{}/{}", model.name, port.name)
}
