//! rl_sar: `base.yaml` of a robot, and `config.yaml` and a network of each of its policies.

mod action;
mod config;
mod frames;
mod joints;
mod terms;

use std::ffi::OsStr;
use std::path::Path;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::{printable, quoted};

use self::config::{Config, Section};
use self::joints::Joints;
use self::terms::Terms;
use super::common::Parts;
use crate::bundle::Bundle;
use crate::description::Description;
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};

/// Reader of rl_sar bundles.
#[derive(Debug)]
pub(super) struct RlSar;

/// Keys that a policy of this family has, below the first key of its file.
const KEYS: [&str; 4] = ["model_name", "num_of_dofs", "clip_obs", "rl_kp"];

impl Family for RlSar {
    fn profile(&self) -> &str {
        include_str!("rl_sar/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let mut documents = Vec::new();
        for file in bundle.with_ending("yaml") {
            // Other YAML files of a folder decide nothing, even if they are damaged.
            if bundle.text(file).is_ok_and(|text| KEYS.iter().all(|key| text.contains(key))) {
                documents.push(Document::read(bundle, file)?);
            }
        }
        documents.retain(|document| !policies(document).is_empty());
        if documents.is_empty() {
            return Ok(None);
        }
        for file in bundle.with_ending("yaml").filter(|file| Path::new(file).ends_with("base.yaml")) {
            documents.push(Document::read(bundle, file)?);
        }
        Ok(Some(Recognized { documents, networks: Vec::new(), others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let Some(own) = chosen(&found.documents, facts)? else { return Ok(Parts::new("policy", 1.0).finish()) };
        let config = Config { own, base: base(&found.documents, own)? };
        require_base(&config)?;
        refuse_others(&config)?;

        let rate = 1.0 / (config.positive("dt")? * config.positive("decimation")?);
        let mut parts = Parts::new("policy", rate);
        facts.note("rate_hz", format!("1 / ({} * {})", config.location("dt"), config.location("decimation")));
        let joints = Joints::read(&config, &mut parts, facts)?;
        parts.constant("default", config.of_joints("default_dof_pos")?);
        facts.note("default", config.location("default_dof_pos"));
        let action = action::act(&config, &joints, &mut parts, facts)?;
        let terms = Terms { config: &config, joints: &joints, action, rate, parts: &mut parts, facts };
        let observation = terms.observe()?;
        network(bundle, &config, joints.len(), observation, &mut parts, facts)?;
        Ok(parts.finish())
    }
}

/// Returns the policies of a file by their first keys.
fn policies(document: &Document) -> Vec<Section<'_>> {
    let sections = document.keys("").into_iter().map(|name| Section { document, name });
    sections.filter(|section| KEYS.iter().all(|key| section.has(key))).collect()
}

/// Returns the only policy, or the one that the answer names; `None` while it is a question.
fn chosen<'a>(documents: &'a [Document], facts: &mut Facts) -> Result<Option<Section<'a>>> {
    let all: Vec<Section<'_>> = documents.iter().flat_map(policies).collect();
    if let [only] = all[..] {
        return Ok(Some(only));
    }
    let names = all.iter().map(|section| printable(section.name)).collect::<Vec<_>>().join(", ");
    let name: Option<String> = facts.missing("config", &format!("which policy of the bundle: {names}?"))?;
    // Files of other policies are not read, and their keys not listed.
    let is_named = |section: &&Section<'_>| name.as_ref().is_some_and(|name| name == section.name);
    all.iter().filter(|section| !is_named(section)).for_each(|section| {
        section.document.node(section.name);
    });
    let Some(name) = &name else { return Ok(None) };
    let named: Vec<Section<'_>> = all.iter().filter(|section| section.name == name).copied().collect();
    match named[..] {
        [one] => Ok(Some(one)),
        [] => bail!("answer config = {:?}: give one of {names}", printable(name)),
        [first, second, ..] => bail!(
            "{} and {} both have the policy {:?}; name the folder of one",
            first.document.file,
            second.document.file,
            printable(name)
        ),
    }
}

/// Returns the robot's section of a base.yaml: its name is the first part of the policy's.
fn base<'a>(documents: &'a [Document], own: Section<'_>) -> Result<Option<Section<'a>>> {
    let robot = robot(own);
    let mut bases = Vec::new();
    for document in documents.iter().filter(|document| Path::new(&document.file).ends_with("base.yaml")) {
        let names = document.keys("");
        bases.extend(names.iter().filter(|name| **name == robot).map(|name| Section { document, name }));
        // Sections of other robots are not read.
        names.iter().filter(|name| **name != robot).for_each(|name| {
            document.node(name);
        });
    }
    ensure!(bases.len() < 2, "several files base.yaml have the robot {:?}; name its folder", printable(robot));
    Ok(bases.pop())
}

fn robot(own: Section<'_>) -> &str {
    own.name.split('/').next().unwrap_or(own.name)
}

/// Refuses a policy whose robot's keys are in a base.yaml outside of the bundle.
fn require_base(config: &Config<'_>) -> Result<()> {
    let missing = ["dt", "decimation"].into_iter().find(|key| !config.own.has(key));
    if let (None, Some(key)) = (config.base, missing) {
        let (file, robot) = (&config.own.document.file, printable(robot(config.own)));
        bail!(
            "{file} has no {key}, which rl_sar reads from {robot}/base.yaml: name the folder {robot}, which has base.yaml and the policy's folder"
        );
    }
    Ok(())
}

/// Refuses what would be deployed in another way.
fn refuse_others(config: &Config<'_>) -> Result<()> {
    let key = "use_pmtg_controller";
    let is_pmtg = config.optional(key, "true or false", |node| node.truth())?.unwrap_or(false);
    ensure!(!is_pmtg, "{} is true: the gait generator PMTG is not supported", config.location(key));
    let framework = config.optional("framework", "a text", |node| node.text())?;
    ensure!(
        framework != Some("isaacsim") || !config.own.has("rows"),
        "{}: this older layout transposes its lists by rows and cols; write them in the order of the policy, and remove rows and cols",
        config.location("rows")
    );
    Ok(())
}

fn network(
    bundle: &Bundle,
    config: &Config<'_>,
    joints: usize,
    observation: Option<usize>,
    parts: &mut Parts,
    facts: &mut Facts,
) -> Result<()> {
    let (file, given) = config.model()?;
    require_network(bundle, config, &file, &given, observation)?;
    let signature = bundle.signature(&file)?;
    let [(input, takes)] = &signature.inputs[..] else {
        bail!("{file}: it has {} inputs, and the deploy code gives one", signature.inputs.len());
    };
    // The deploy code takes the first output of several.
    let (output, gives) = signature.outputs.first().with_context(|| format!("{file}: it has no output"))?;
    let differs = |own: Option<usize>, graph: Option<usize>| own.zip(graph).filter(|(own, graph)| own != graph);
    for (what, own, graph, key, port) in [
        ("length of the observation", observation, *takes, "observations", input),
        ("length of the action", Some(joints), *gives, "num_of_dofs", output),
    ] {
        if let Some((own, graph)) = differs(own, graph.filter(|len| *len > 1)) {
            return Err(Facts::contradiction(
                what,
                (&config.location(key), &format!("{own} values")),
                (&format!("{file}: {}", printable(port)), &format!("{graph} values")),
            ));
        }
    }
    facts.note("policy", config.location("model_name"));
    parts.network(&file, input, output);
    Ok(())
}

/// Refuses a bundle whose network is not there, or not ONNX.
fn require_network(
    bundle: &Bundle,
    config: &Config<'_>,
    file: &str,
    given: &str,
    observation: Option<usize>,
) -> Result<()> {
    if bundle.has(file) {
        return Ok(());
    }
    let at = config.location("model_name");
    let sibling = format!("{}.pt", file.strip_suffix(".onnx").unwrap_or(file));
    let script = [given, &sibling].into_iter().find(|file| bundle.has(file));
    let script = script.with_context(|| format!("{at}: there is no {:?} in the bundle", printable(given)))?;
    let len = observation.map_or_else(|| "LENGTH".to_owned(), |len| len.to_string());
    let [script, file] = [script, file].map(|file| quoted(OsStr::new(&*printable(file))));
    let (script, file) = (script?, file?);
    bail!(
        "{at}: {script} is TorchScript, which is not read; export it as ONNX beside it: python3 -c \"import sys, torch; \
         torch.onnx.export(torch.jit.load(sys.argv[1], 'cpu').eval(), torch.zeros(1, {len}), sys.argv[2], \
         input_names=['obs'], output_names=['actions'])\" {script} {file} (from PyTorch 2.5 on, add dynamo=False)"
    )
}
