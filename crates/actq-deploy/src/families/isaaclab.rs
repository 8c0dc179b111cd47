//! Isaac Lab: `IO_descriptors.yaml`, the `env.yaml` of a training, or both, beside `policy.onnx`.

mod agent;
mod agree;
mod describe;
mod descriptors;
mod environment;
mod model;
mod patterns;
mod values;

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail};
use actq::text::printable;

use self::agent::Agent;
use self::describe::Builder;
use self::environment::Environment;
use self::model::{MODULES, Policy};
use self::patterns::Joints;
use super::common::{ACTION, Graph, metadata_document, names};
use crate::bundle::{Bundle, beside};
use crate::description::{Description, Network};
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};
use crate::sources::Sources as _;
use crate::yaml::Node;

/// Reader of Isaac Lab bundles.
#[derive(Debug)]
pub(super) struct IsaacLab;

/// Name of the learner's configuration.
const AGENT: &str = "agent.yaml";
/// Recurrent inputs of the exporters of RSL-RL and `isaaclab_rl`, and the outputs that they take.
const RECURRENT: [(&str, &str); 2] = [("h_in", "h_out"), ("c_in", "c_out")];
/// Key of the ONNX metadata that some exporters add.
const JOINT_NAMES: &str = "joint_names";

impl Family for IsaacLab {
    fn profile(&self) -> &str {
        include_str!("isaaclab/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let (mut exported, mut environments) = (Vec::new(), Vec::new());
        for file in bundle.with_ending("yaml").chain(bundle.with_ending("yml")) {
            // Only files that name its modules can be of this family; the others need not be YAML that this reader
            // knows.
            let names_module = |text: &String| MODULES.iter().any(|module| text.contains(module));
            let Some(text) = bundle.text(file).ok().filter(names_module) else { continue };
            let root = Node::parse(&text).context(file.to_owned())?;
            let document = Document::of(file, root.numbered());
            if descriptors::is_one(&document) {
                exported.push(document);
            } else if environment::is_one(&document) {
                environments.push(document);
            }
        }
        for documents in [&exported, &environments] {
            if let [first, second, ..] = &documents[..] {
                bail!("several policies of this family: {} and {}; name the folder of one", first.file, second.file);
            }
        }
        let mut documents: Vec<Document> = exported.into_iter().chain(environments).collect();
        let Some(first) = documents.first() else { return Ok(None) };
        // That of the training, which stores both.
        let training = documents.last().map(|environment| beside(&environment.file, AGENT));
        let agent = match training.filter(|file| bundle.has(file)) {
            Some(file) => Some(file),
            None => bundle.find(AGENT)?.map(str::to_owned),
        };
        let network = match bundle.find("policy.onnx")? {
            Some(file) => file,
            None => match &bundle.with_ending("onnx").collect::<Vec<_>>()[..] {
                [only] => only,
                [] => bail!(
                    "{}: there is no ONNX file with it; export one with Isaac Lab's play.py, which writes exported/policy.onnx",
                    first.file
                ),
                several => bail!("{}: which of {} is its policy? Call it policy.onnx", first.file, several.join(", ")),
            },
        };
        let signature = bundle.signature(network)?;
        if signature.metadata.contains_key(JOINT_NAMES) {
            documents.push(metadata_document(network, &signature.metadata));
        }
        if let Some(file) = agent {
            let root = bundle.text(&file).and_then(|text| Node::parse(&text).context(file.clone()))?;
            documents.push(Document::of(&file, root.numbered()));
        }
        Ok(Some(Recognized { documents, networks: vec![network.to_owned()], others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let file = &found.networks[0];
        let signature = bundle.signature(file)?;
        let graph = Graph::of(file, &signature)?;
        let find = |is_one: fn(&Document) -> bool| found.documents.iter().find(|document| is_one(document));
        let (exported, environment) = (find(descriptors::is_one), find(environment::is_one));
        let meta = find(|document| document.peek(JOINT_NAMES).is_some());
        let asset = facts.value("asset")?.unwrap_or_else(|| "robot".to_owned());
        let learner = found.documents.iter().find(|document| document.file.rsplit('/').next() == Some(AGENT));
        let agent = learner.map(Agent::of).transpose()?.unwrap_or_default();
        let group = match &agent.group {
            Some((group, at)) => {
                facts.note("group", at.clone());
                group.clone()
            }
            None => facts.value("group")?.unwrap_or_else(|| "policy".to_owned()),
        };

        let mut orders = Vec::new();
        if let Some(yaml) = exported {
            orders.push(descriptors::joints(yaml, &asset)?);
        }
        if let Some(meta) = meta {
            orders.push(Joints::new(names(meta, JOINT_NAMES)?, meta.location(JOINT_NAMES))?);
        }
        let ordering = format!("scene.{asset}.joint_ordering");
        // From release 3.0.0 on; a text names a convention.
        let stated = environment.filter(|yaml| yaml.peek(&ordering).is_some());
        if let Some((yaml, names)) = stated.and_then(|yaml| Some((yaml, yaml.peek(&ordering)?.texts()?))) {
            orders.push(Joints::new(names, yaml.location(&ordering))?);
        }
        for other in orders.iter().skip(1) {
            agree::orders(&orders[0], other)?;
        }
        let joints = match orders.into_iter().next() {
            Some(joints) => joints,
            None => {
                let names = match stated {
                    Some(yaml) => facts.missing("joints", &asked_order(yaml, &ordering))?,
                    None => facts.value::<Vec<String>>("joints")?,
                };
                match names {
                    Some(names) => Joints::new(names, "answer joints".to_owned())?,
                    None => Joints::placeholders(graph.actions),
                }
            }
        };
        let exported = exported.map(|yaml| descriptors::read(yaml, &asset, &group, joints.clone())).transpose()?;
        let policy: Policy = match (exported, environment) {
            (exported, Some(yaml)) => {
                let mut policy = Environment { yaml, asset: &asset, group: &group, joints }.read(facts)?;
                if let Some(exported) = exported {
                    agree::with_descriptors(&mut policy, &exported)?;
                }
                policy
            }
            (Some(exported), None) => exported,
            (None, None) => bail!("there is neither IO_descriptors.yaml nor env.yaml"),
        };
        if let Some(meta) = meta {
            agree::with_metadata(&policy, meta, environment.is_some())?;
        }
        let mut states: BTreeMap<String, String> = RECURRENT
            .iter()
            .filter(|(input, _)| signature.inputs.iter().any(|(name, _)| name == input))
            .map(|(input, output)| ((*input).to_owned(), (*output).to_owned()))
            .collect();
        let network = Network { name: "policy".to_owned(), file: file.clone(), inputs: [].into(), states: [].into() };
        let outputs = [graph.output.clone()];
        if learner.is_some() || !states.is_empty() {
            let network = bundle.network(&network, &outputs).with_context(|| file.clone())?;
            // Cells keep their states by themselves.
            states.retain(|input, _| network.states().iter().all(|(kept, _)| kept != input));
            if let (Some(yaml), Some(part)) = (learner, network.part(0)) {
                agent::agrees(yaml, &part.policy.graph, file, facts)?;
            }
        }
        Builder { policy: &policy, graph: &graph, clip: agent.clip, action: ACTION, facts }.make(states)
    }
}

/// Returns the question of the joints' order, of an environment that has the key `ordering`.
fn asked_order(yaml: &Document, ordering: &str) -> String {
    let given = yaml.peek(ordering).and_then(Node::text).filter(|text| !text.is_empty()).unwrap_or("null");
    format!(
        "which joints does the robot have, in the order of its observations? A list of names, as env.scene[\"robot\"].joint_names prints them. \
         {} = {}: \"physx\" is breadth-first, \"mjwarp\" depth-first, and null the order of the physics of the training, which is breadth-first in \
         PhysX and depth-first in MJWarp (Newton)",
        yaml.location(ordering),
        printable(given)
    )
}
