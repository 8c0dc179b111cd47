//! The connections between the models of a pipeline.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::model::{Model, Port};
use crate::document::Document;
use crate::facts::Facts;

/// The number of a model, and that of one of its inputs or outputs.
pub(super) type At = (usize, usize);

/// Where the value of an input comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// The application gives it.
    Application,
    /// An output of this tick.
    Output(At),
    /// An output of the tick before.
    Before(At),
}

/// The connections.
pub(super) struct Pipeline {
    /// The source of each input, and its file and key.
    sources: BTreeMap<At, (Source, String)>,
    /// Outputs that leave the pipeline.
    pub(super) outputs: Vec<At>,
}

impl Pipeline {
    pub(super) fn of(yaml: &Document, models: &[Model]) -> Result<Self> {
        let mut pipeline = Self { sources: BTreeMap::new(), outputs: Vec::new() };
        for (flow, is_feedback) in [("pipeline.data_flow", false), ("pipeline.feedback_flow", true)] {
            let keys = yaml.keys(flow);
            if keys.is_empty() {
                yaml.node(flow);
            }
            for key in keys {
                let path = format!("{flow}.{key}");
                let at = yaml.location(&path);
                let from = port(key, models, outputs).with_context(|| at.clone())?;
                for target in yaml.texts(&path)? {
                    let to = port(&target, models, inputs).with_context(|| at.clone())?;
                    check_order(from, to, is_feedback, &format!("{at}: {:?}", printable(&target)))?;
                    check_shapes(models, from, to)?;
                    let source = if is_feedback { Source::Before(from) } else { Source::Output(from) };
                    pipeline.add(models, to, source, at.clone())?;
                }
            }
        }
        for (path, is_input) in [("pipeline.inputs", true), ("pipeline.outputs", false)] {
            for model in yaml.keys(path) {
                let path = format!("{path}.{model}");
                for name in yaml.texts(&path)? {
                    let ports = if is_input { inputs } else { outputs };
                    let found =
                        port(&format!("{model}/{name}"), models, ports).with_context(|| yaml.location(&path))?;
                    if is_input {
                        pipeline.add(models, found, Source::Application, yaml.location(&path))?;
                    } else if !pipeline.outputs.contains(&found) {
                        pipeline.outputs.push(found);
                    }
                }
            }
        }
        for (i, model) in models.iter().enumerate() {
            let lost = (0..model.inputs.len()).find(|input| !pipeline.sources.contains_key(&(i, *input)));
            if let Some(input) = lost {
                bail!("{}: nothing gives this input; add it to pipeline.inputs, or to a flow", model.inputs[input].at);
            }
        }
        Ok(pipeline)
    }

    fn add(&mut self, models: &[Model], to: At, source: Source, at: String) -> Result<()> {
        match self.sources.insert(to, (source, at.clone())) {
            None => Ok(()),
            Some((_, other)) => {
                let input = &models[to.0].inputs[to.1];
                Err(Facts::contradiction(
                    &format!("source of {:?}", printable(&input.name)),
                    (&other, "one"),
                    (&at, "another"),
                ))
            }
        }
    }

    /// Returns the source of an input, and its file and key.
    pub(super) fn source(&self, of: At) -> (Source, &str) {
        self.sources.get(&of).map_or((Source::Application, ""), |(source, at)| (*source, at))
    }
}

fn inputs(model: &Model) -> &[Port] {
    &model.inputs
}

fn outputs(model: &Model) -> &[Port] {
    &model.outputs
}

/// Finds a port by its text, `MODEL/PORT`.
fn port(text: &str, models: &[Model], ports: fn(&Model) -> &[Port]) -> Result<At> {
    let find = |(model, name): (&str, &str)| {
        let model = models.iter().position(|other| other.name == model)?;
        let port = ports(&models[model]).iter().position(|port| port.name == name)?;
        Some((model, port))
    };
    let found = text.split_once('/').and_then(find);
    found.with_context(|| {
        let all =
            models.iter().flat_map(|model| ports(model).iter().map(|port| format!("{}/{}", model.name, port.name)));
        let all: Vec<String> = all.take(20).collect();
        format!("there is no port {:?}; expected one of {}", printable(text), all.join(", "))
    })
}

/// Refuses a flow that LEAPP's runtime passes in another tick than its key says: it runs the models in their order, and
/// passes each output at once.
fn check_order(from: At, to: At, is_feedback: bool, at: &str) -> Result<()> {
    ensure!(
        is_feedback || from.0 < to.0,
        "{at} runs before the model that gives its value, so it reads the tick before; move it to pipeline.feedback_flow"
    );
    ensure!(
        !is_feedback || from.0 >= to.0,
        "{at} runs after the model that gives its value, so it reads this tick; move it to pipeline.data_flow"
    );
    Ok(())
}

fn check_shapes(models: &[Model], from: At, to: At) -> Result<()> {
    let (output, input) = (&models[from.0].outputs[from.1], &models[to.0].inputs[to.1]);
    if output.shape == input.shape {
        return Ok(());
    }
    Err(Facts::contradiction(
        &format!("shape of {:?}", printable(&input.name)),
        (&output.at, &format!("{:?}", output.shape)),
        (&input.at, &format!("{:?}", input.shape)),
    ))
}
