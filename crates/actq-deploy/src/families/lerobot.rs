//! Policies of LeRobot that read states only: `config.json` and the processors' files, with an ONNX file of the
//! network.

mod dataset;
mod feature;
mod graph;
mod normalizer;
mod processors;
mod statistics;

use std::path::Path;

use actq::error::{Result, bail, ensure};
use actq::text::printable;

use self::dataset::Training;
use self::feature::{Feature, KEYS, join};
use self::graph::Graph;
use self::normalizer::Normalizer;
use self::processors::{Normalization, PROCESSORS};
use super::common::{Parts, count};
use crate::bundle::Bundle;
use crate::description::{Description, History, Op, Order, TargetKind};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};
use crate::yaml::Node;

/// Reader of LeRobot bundles.
#[derive(Debug)]
pub(super) struct Lerobot;

/// File of the policy's configuration.
const CONFIG: &str = "config.json";
/// Most observations of a history.
const MAX_FRAMES: usize = 1000;

impl Family for Lerobot {
    fn profile(&self) -> &str {
        include_str!("lerobot/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let is_config = |file: &&str| {
            Path::new(file).ends_with(CONFIG)
                && bundle.text(file).is_ok_and(|text| KEYS.iter().all(|key| text.contains(&format!("\"{key}\""))))
        };
        let configs: Vec<&str> = bundle.with_ending("json").filter(is_config).collect();
        let config = match configs[..] {
            [] => return Ok(None),
            [config] => config,
            _ => bail!("several policies of this family: {}; name the folder of one", configs.join(", ")),
        };
        let mut documents = vec![Document::read(bundle, config)?];
        for file in PROCESSORS.map(|file| join(folder(config), file)) {
            if bundle.has(&file) {
                documents.extend(processors::documents(bundle, &file)?);
            }
        }
        let networks = bundle.with_ending("onnx").map(str::to_owned).collect();
        Ok(Some(Recognized { documents, networks, others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let config = &found.documents[0];
        let folder = folder(&config.file);
        let features = Feature::observations(config)?;
        let action = Feature::action(config)?;
        let frames = check_policy(config, facts)?;
        let graph = Graph::of(bundle, &found.networks, &config.file, facts)?;
        graph.check_output(&action)?;
        let normalization = Normalization::of(bundle, folder, &found.documents)?;
        let normalizers = features.iter().map(|feature| normalization.normalizer(feature, config, facts));
        let normalizers: Vec<Normalizer> = normalizers.collect::<Result<_>>()?;
        let reverse = normalization.normalizer(&action, config, facts)?;
        let network = graph.network(&features, frames, |feature| format!("{}_normalized", feature.plain()))?;
        graph.refuse_normalizers(bundle, &network, &normalizers, &reverse)?;

        let training = Training::of(bundle, folder, facts)?;
        let mut parts = Parts::new("policy", training.rate(facts)?);
        let history = match frames {
            1 => None,
            _ => {
                let (first, fill) = (facts.value_or_default("history.first")?, facts.value_or_default("history.fill")?);
                Some(History { length: frames, stride: 1, first, fill, current: true })
            }
        };
        for (feature, normalizer) in features.iter().zip(&normalizers) {
            let name = feature.plain();
            match training.names(feature)? {
                Some((names, at)) => {
                    parts.joints(&name, names);
                    parts.raw_joints(&name, &name, "");
                    facts.note(&format!("joints.{name}"), at);
                }
                None => parts.raw(&name, feature.len, ""),
            }
            facts.note(&name, feature.at.clone());
            let mut ops = normalizer.normalize(&mut parts, feature);
            let mut source = normalizer.source.clone();
            if let Some(history) = history {
                ops.push(Op::History(history));
                source += &format!("; {}; {}", config.location("n_obs_steps"), facts.source("history.fill"));
            }
            let value = format!("{name}_normalized");
            parts.value(&value, &name, ops);
            facts.note(&value, source);
        }
        parts.wired(network);
        let given = format!("policy.{}", graph.output);
        parts.act(&given);
        let ops = reverse.reverse(&mut parts, &action);
        parts.value("target", &given, ops);
        facts.note("target", reverse.source.clone());
        targets(&mut parts, &action, training.names(&action)?, facts)?;
        Ok(parts.finish())
    }
}

/// Checks that an image can run the policy; returns the number of observations that it reads.
fn check_policy(config: &Document, facts: &mut Facts) -> Result<usize> {
    let kind = config.required("type", "a type of policies", Node::text)?;
    let plain: Option<Vec<String>> = facts.value("types")?;
    if plain.is_some_and(|plain| plain.iter().all(|plain| plain != kind)) {
        let complete: Option<bool> = facts.value("graph.complete")?;
        ensure!(
            complete != Some(false),
            "graph.complete = false: {} = {:?} cannot run as one network; export one that gives the action",
            config.location("type"),
            printable(kind)
        );
    }
    let key = "temporal_ensemble_coeff";
    ensure!(
        config.node(key).is_none(),
        "{}: an image cannot average the actions of several chunks; set it to null",
        config.location(key)
    );
    let key = "n_action_steps";
    let actions = config.optional(key, "a number of actions above 0", |node| count(node).filter(|n| *n > 0))?;
    if actions.is_some_and(|actions| actions > 1) {
        let replan: Option<bool> = facts.value("replan")?;
        ensure!(
            replan != Some(false),
            "replan = false: {} = {}, and an image cannot give several actions of a chunk; deploy with replan = true",
            config.location(key),
            actions.unwrap_or_default()
        );
    }
    let key = "n_obs_steps";
    let frames = config.optional(key, "a number of observations from 1 to 1000", |node| {
        count(node).filter(|n| (1..=MAX_FRAMES).contains(n))
    })?;
    Ok(frames.unwrap_or(1))
}

/// Adds the targets: values whose names end in .pos or .vel are positions or velocities, and a rule says what the
/// others are.
fn targets(parts: &mut Parts, action: &Feature, names: Option<(Vec<String>, String)>, facts: &mut Facts) -> Result<()> {
    let (names, at) = names.unzip();
    let mut kinds = Vec::new();
    for i in 0..action.len {
        let name = names.as_ref().map_or("", |names| &names[i]);
        kinds.push(match name.rsplit_once('.') {
            Some((_, "pos")) => TargetKind::Position,
            Some((_, "vel")) => TargetKind::Velocity,
            _ => facts.value("target.kind")?.unwrap_or(TargetKind::Position),
        });
    }
    if let Some(at) = at {
        facts.note("joints.action", at);
    }
    for (kind, suffix) in [(TargetKind::Position, "pos"), (TargetKind::Velocity, "vel"), (TargetKind::Torque, "torque")]
    {
        let places: Vec<usize> = (0..action.len).filter(|i| kinds[*i] == kind).collect();
        let (value, order) = match places.len() {
            0 => continue,
            all if all == action.len => ("target".to_owned(), "action".to_owned()),
            _ => (format!("target_{suffix}"), format!("action_{suffix}")),
        };
        if places.len() < action.len {
            parts.value(&value, "target", vec![Op::Select(Order::Places(places.clone()))]);
        }
        match &names {
            Some(names) => {
                parts.joints(&order, places.iter().map(|i| names[*i].clone()).collect());
                parts.target_joints(kind, &value, &order);
            }
            None => parts.target(kind, &value),
        }
    }
    Ok(())
}

/// Returns the folder of a file in the bundle; empty for the bundle's own.
fn folder(file: &str) -> &str {
    file.rsplit_once('/').map_or("", |(folder, _)| folder)
}
