//! The description of a pipeline.

use std::collections::{BTreeMap, BTreeSet};

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::initial::Initial;
use super::model::{Model, Port};
use super::pipeline::{At, Pipeline, Source};
use super::targets::{gains, targets};
use crate::bundle::Bundle;
use crate::description::{Description, Gains, Network, Numbers};
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::Parts;
use crate::sources::{Compute, Sources as _};

/// A model's network, opened for the outputs that are used; `None` if none is.
type Opened = Option<Box<dyn Compute>>;

/// A description under construction.
pub(super) struct Builder<'a> {
    models: &'a [Model],
    pipeline: &'a Pipeline,
    facts: &'a mut Facts,
    parts: Parts,
    initial: Initial,
    /// Name of each model's network.
    networks: Vec<String>,
    /// Names of values and networks.
    taken: BTreeSet<String>,
    /// Lists of names with the name of each list.
    orders: BTreeMap<Vec<String>, String>,
}

pub(super) fn describe(
    bundle: &Bundle,
    yaml: &Document,
    models: &[Model],
    pipeline: &Pipeline,
    facts: &mut Facts,
) -> Result<Description> {
    let rate = rate(yaml, facts)?;
    let initial = Initial::of(bundle, yaml, models, pipeline)?;
    let targets = targets(models, pipeline, facts)?;
    let mut builder = Builder {
        models,
        pipeline,
        facts,
        parts: Parts::new("policy", rate),
        initial,
        networks: Vec::new(),
        taken: BTreeSet::new(),
        orders: BTreeMap::new(),
    };
    for model in models {
        let name = builder.free(&model.name);
        builder.facts.note(&name, model.at.clone());
        builder.networks.push(name);
    }
    let used: BTreeSet<At> = targets.iter().map(|(at, _)| *at).collect();
    for (i, opened) in opened(bundle, models, pipeline, used)?.into_iter().enumerate() {
        if let Some(network) = opened {
            builder.network(i, network.as_ref())?;
        }
    }
    let mut values = Vec::new();
    for (at, kind) in targets {
        let (value, port) = (builder.value(at), &models[at.0].outputs[at.1]);
        builder.facts.note(&value, port.at.clone());
        match &port.names {
            Some(names) => {
                let order = builder.order(&port.name, names);
                builder.parts.target_joints(kind, &value, &order);
            }
            None => builder.parts.target(kind, &value),
        }
        values.push(value);
    }
    match &values[..] {
        [only] => builder.parts.act(only),
        several => {
            let action = builder.free("action");
            builder.parts.values(&action, &several.iter().map(String::as_str).collect::<Vec<_>>());
            builder.parts.act(&action);
        }
    }
    if let Some([stiffness, damping]) = gains(bundle, models, pipeline)? {
        let joints = (!stiffness.names.is_empty()).then(|| builder.order("gains", &stiffness.names));
        builder.facts.note("gains", format!("{}; {}", stiffness.at, damping.at));
        builder.parts.gains(Gains { joints, stiffness: stiffness.values, damping: damping.values });
    }
    Ok(builder.parts.finish())
}

fn rate(yaml: &Document, facts: &mut Facts) -> Result<f64> {
    let key = "pipeline.configs.frequency";
    let rate = yaml.optional(key, "a number above 0", |node| node.number().filter(|number| *number > 0.0))?;
    match rate {
        Some(rate) => {
            facts.note("rate_hz", yaml.location(key));
            Ok(rate)
        }
        None => Ok(facts.value("rate_hz")?.unwrap_or(1.0)),
    }
}

/// Opens the networks for the outputs `used`, and those that these depend on.
fn opened(bundle: &Bundle, models: &[Model], pipeline: &Pipeline, mut used: BTreeSet<At>) -> Result<Vec<Opened>> {
    loop {
        let mut all = Vec::new();
        let mut needed = used.clone();
        for (i, model) in models.iter().enumerate() {
            let outputs = used.iter().filter(|(of, _)| *of == i);
            let outputs: Vec<String> = outputs.map(|(_, output)| model.outputs[*output].graph.clone()).collect();
            if outputs.is_empty() {
                all.push(None);
                continue;
            }
            let (name, file) = (model.name.clone(), model.file.clone());
            let network = Network { name, file, inputs: [].into(), states: [].into() };
            let network = bundle.network(&network, &outputs).with_context(|| model.at.clone())?;
            for (input, _) in read(model, network.as_ref()) {
                if let Source::Output(from) | Source::Before(from) = pipeline.source((i, input)).0 {
                    needed.insert(from);
                }
            }
            all.push(Some(network));
        }
        if needed.len() == used.len() {
            return Ok(all);
        }
        used = needed;
    }
}

/// Returns the inputs that a network's outputs depend on.
fn read<'a>(model: &'a Model, network: &dyn Compute) -> Vec<(usize, &'a Port)> {
    let is_read = |(_, port): &(usize, &Port)| network.inputs().iter().any(|(name, _)| *name == port.graph);
    model.inputs.iter().enumerate().filter(is_read).collect()
}

impl Builder<'_> {
    /// Returns a name like `wanted` that nothing has yet.
    fn free(&mut self, wanted: &str) -> String {
        // A point separates a network from its output.
        let mut name = wanted.replace('.', "_");
        while !self.taken.insert(name.clone()) {
            name.push('_');
        }
        name
    }

    /// Returns the name of an output's value.
    fn value(&self, (model, output): At) -> String {
        format!("{}.{}", self.networks[model], self.models[model].outputs[output].graph)
    }

    /// Returns the name of a list of names: that of an equal one, or one like `wanted`.
    fn order(&mut self, wanted: &str, names: &[String]) -> String {
        if let Some(order) = self.orders.get(names) {
            return order.clone();
        }
        let mut order = wanted.to_owned();
        while self.orders.values().any(|other| *other == order) {
            order.push('_');
        }
        self.parts.joints(&order, names.to_vec());
        self.orders.insert(names.to_vec(), order.clone());
        order
    }

    /// Adds a network, with the raw inputs and states that it reads.
    fn network(&mut self, i: usize, network: &dyn Compute) -> Result<()> {
        let model = &self.models[i];
        let mut inputs = BTreeMap::new();
        for (input, port) in read(model, network) {
            let (source, at) = self.pipeline.source((i, input));
            let value = match source {
                Source::Application => self.raw(model, port),
                Source::Output(from) => self.value(from),
                Source::Before(from) => {
                    let name = self.free(&port.name);
                    let (start, also) = self.initial.start(model, port, self.facts)?;
                    self.facts.note(&name, format!("{at}; {also}"));
                    let is_one = start.iter().all(|number| *number == start[0]);
                    let start = if is_one { Numbers::All(start[0]) } else { Numbers::Each(start) };
                    self.parts.state_from(&name, port.len, start, &self.value(from));
                    name
                }
            };
            inputs.insert(port.graph.clone(), value);
        }
        for (input, output) in network.states() {
            self.check_cell(i, input, output)?;
        }
        let (name, file) = (self.networks[i].clone(), model.file.clone());
        self.parts.wired(Network { name, file, inputs, states: [].into() });
        Ok(())
    }

    /// Adds a raw input; returns its name.
    fn raw(&mut self, model: &Model, port: &Port) -> String {
        let has_same = |other: &&Model| other.inputs.iter().any(|input| input.name == port.name);
        let is_shared = self.models.iter().filter(has_same).count() > 1;
        let name = self.free(&if is_shared { format!("{}_{}", model.name, port.name) } else { port.name.clone() });
        self.facts.note(&name, port.at.clone());
        match &port.names {
            Some(names) => {
                let order = self.order(&name, names);
                self.parts.raw_joints(&name, &order, &port.unit);
            }
            None => self.parts.raw(&name, port.len, &port.unit),
        }
        name
    }

    /// Refuses a state of an LSTM or GRU that the pipeline feeds otherwise than the image does.
    fn check_cell(&mut self, i: usize, input: &str, output: &str) -> Result<()> {
        let model = &self.models[i];
        let found = model.inputs.iter().enumerate().find(|(_, port)| port.graph == input);
        let (place, port) =
            found.with_context(|| format!("{}: no input is called {:?}", model.at, printable(input)))?;
        let (source, at) = self.pipeline.source((i, place));
        let is_own = matches!(source, Source::Before(from) if from.0 == i && model.outputs[from.1].graph == output);
        if !is_own {
            return Err(Facts::contradiction(
                &format!("next value of {:?}", printable(&port.name)),
                (at, "another source"),
                (&model.file, &format!("the output {:?} of the same cell", printable(output))),
            ));
        }
        let (start, source) = self.initial.start(model, port, self.facts)?;
        ensure!(
            start.iter().all(|number| *number == 0.0),
            "{source}: the state of an LSTM or GRU starts at 0 in an image, and this one does not; export it with zeros"
        );
        Ok(())
    }
}
