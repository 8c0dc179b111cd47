//! humanoidverse's sim2real code (FALCON, ASAP): one YAML file beside ONNX files.

mod asap;
mod falcon;
mod lengths;
mod phases;
mod reader;
mod robot;
mod target;
mod terms;

use std::path::Path;

use actq::error::{Context as _, Result, bail, ensure};

use self::reader::Reader;
use self::robot::Robot;
use super::common::{Parts, Ports};
use crate::bundle::Bundle;
use crate::description::Description;
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};
use crate::yaml::Node;

/// Reader of humanoidverse bundles.
#[derive(Debug)]
pub(super) struct Humanoidverse;

/// Keys that every file of this family has.
const KEYS: [&str; 3] = ["DEFAULT_DOF_ANGLES", "obs_scales", "obs_dims"];

impl Family for Humanoidverse {
    fn profile(&self) -> &str {
        include_str!("humanoidverse/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let mut documents = Vec::new();
        for file in bundle.with_ending("yaml").chain(bundle.with_ending("yml")) {
            // Other YAML files of a folder decide nothing, even if they are damaged.
            if bundle.text(file).is_ok_and(|text| KEYS.iter().all(|key| text.contains(key))) {
                let document = Document::read(bundle, file)?;
                if KEYS.iter().all(|key| document.peek(key).is_some()) {
                    documents.push(document);
                }
            }
        }
        if documents.is_empty() {
            return Ok(None);
        }
        let files: Vec<&str> = documents.iter().map(|document| document.file.as_str()).collect();
        ensure!(files.len() == 1, "several files describe a robot: {}; name the folder of one", files.join(", "));
        let networks = bundle.with_ending("onnx").map(str::to_owned).collect();
        Ok(Some(Recognized { documents, networks, others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let yaml = found.documents.first().context("there is no YAML file")?;
        let robot = Robot::read(yaml, facts)?;
        let asap = yaml.peek("obs_dict").is_none() && yaml.peek("obs_list").is_none();
        ensure!(
            !asap || asap::is_one(yaml),
            "{}: it has neither obs_dict (FALCON) nor history_loco_config or history_mimic_config (ASAP)",
            yaml.file
        );
        let file = network(yaml, &found.networks, facts)?;
        let ports = ports(bundle, &file)?;
        let rate = rate(yaml, facts)?;
        let mut reader = Reader {
            yaml,
            parts: Parts::new("policy", rate),
            facts,
            rate,
            dims: "obs_dims".to_owned(),
            action_len: ports.action_len,
            action_len_from: format!("{file}, output {:?}", ports.output),
            robot,
            active: None,
            motion: None,
            has_phase: false,
        };
        reader.parts.constant("default", reader.robot.default.clone());
        if reader.robot.by_name {
            reader.parts.joints("robot", reader.robot.names.clone());
        }
        let len = if asap { reader.asap(&file, ports.observation_len)? } else { reader.falcon()? };
        if let Some(fixed) = ports.observation_len.filter(|fixed| *fixed != len) {
            return Err(Facts::contradiction(
                "length of the observation",
                (&yaml.file, &format!("{len} values, by its terms, dimensions and histories")),
                (&format!("{file}, input {:?}", ports.input), &format!("{fixed} values")),
            ));
        }
        reader.parts.network(&file, &ports.input, &ports.output);
        reader.act()?;
        reader.gains()?;
        Ok(reader.parts.finish())
    }
}

/// Reads the observation's input and the action's output of a network.
fn ports(bundle: &Bundle, file: &str) -> Result<Ports> {
    let signature = bundle.signature(file)?;
    let input = match &signature.inputs[..] {
        [one] => Some(one),
        several => several.iter().find(|(name, _)| name == "actor_obs"),
    };
    let (input, observation_len) = input.with_context(|| format!("{file}: it has no input actor_obs"))?;
    // The deploy code reads the first output only.
    let output = signature.outputs.first();
    let (output, action_len) = output.with_context(|| format!("{file}: it has no output"))?;
    // A graph whose axes are all dynamic has no fixed lengths.
    let fixed_len = |len: &Option<usize>| len.filter(|len| *len > 1);
    Ok(Ports {
        input: input.clone(),
        output: output.clone(),
        observation_len: fixed_len(observation_len),
        action_len: fixed_len(action_len),
    })
}

/// Returns the ticks a second.
fn rate(yaml: &Document, facts: &mut Facts) -> Result<f64> {
    let rate = match yaml.optional("rl_rate", "a number of ticks a second", Node::number)? {
        Some(rate) => {
            facts.note("rate_hz", yaml.location("rl_rate"));
            rate
        }
        None => facts.value("rate_hz")?.unwrap_or(1.0),
    };
    ensure!(rate > 0.0, "rate_hz = {rate}: give a number above 0");
    Ok(rate)
}

/// Returns the network: the file that model_path names, the only one, or the answer.
fn network(yaml: &Document, networks: &[String], facts: &mut Facts) -> Result<String> {
    let path = yaml.optional("model_path", "a path", Node::text)?.map(|path| path.trim_start_matches("./"));
    let named = |path: &str| {
        let mut found = networks.iter().filter(|file| !path.is_empty() && Path::new(file).ends_with(path));
        found.next().filter(|_| found.next().is_none())
    };
    if let Some(file) = path.and_then(named) {
        facts.note("network", yaml.location("model_path"));
        return Ok(file.clone());
    }
    match networks {
        [] => bail!("{}: there is no ONNX file with it", yaml.file),
        [only] => {
            let other = path.map_or(String::new(), |path| format!("; {} names {path:?}", yaml.location("model_path")));
            facts.note("network", format!("the only ONNX file{other}"));
            Ok(only.clone())
        }
        _ => facts.choose_one_of("network", &networks.iter().map(String::as_str).collect::<Vec<_>>()),
    }
}
