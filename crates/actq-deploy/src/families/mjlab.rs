//! mjlab and its forks: the metadata that the exporter stores in the ONNX file, alone or with the YAML file of a ROS 2
//! node.

mod agreed;
mod frames;
mod robot;
mod ros;
mod stated;
mod target;
mod terms;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use self::robot::Robot;
use self::ros::{ROS_KEY, Ros, RosNode};
use self::target::target;
use self::terms::terms;
use super::common::{Graph, Parts, metadata_document};
use crate::bundle::Bundle;
use crate::description::Description;
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};

/// Reader of mjlab bundles.
#[derive(Debug)]
pub(super) struct Mjlab;

/// Keys of the metadata that an export of this family has.
const KEYS: [&str; 4] = ["joint_names", "observation_names", "default_joint_pos", "action_scale"];

impl Family for Mjlab {
    fn profile(&self) -> &str {
        include_str!("mjlab/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let mut networks = Vec::new();
        for file in bundle.with_ending("onnx") {
            // A file that cannot be read is of no family, or its reader says why.
            let Ok(signature) = bundle.signature(file) else { continue };
            if KEYS.iter().all(|key| signature.metadata.contains_key(*key)) {
                networks.push((file, signature.metadata));
            }
        }
        if networks.is_empty() {
            return Ok(None);
        }
        let mut nodes = Vec::new();
        for file in bundle.with_ending("yaml").chain(bundle.with_ending("yml")) {
            if bundle.text(file).is_ok_and(|text| text.contains(ROS_KEY)) {
                let document = Document::read(bundle, file)?;
                nodes.push(RosNode::all(&document)?.into_iter().map(|node| (file, node)).collect::<Vec<_>>());
            }
        }
        let nodes = nodes.concat();
        let pairs = nodes.iter().flat_map(|node| networks.iter().map(move |network| (node, network)));
        let fits = |((_, node), (file, _)): &(&(&str, RosNode), &(&str, _))| {
            file.rsplit('/').next() == node.model.rsplit('/').next()
        };
        let pairs: Vec<_> = pairs.filter(fits).collect();
        let (network, yaml) = match (&pairs[..], &nodes[..], &networks[..]) {
            ([((yaml, _), network)], ..) => (*network, Some(*yaml)),
            ([], [], [only]) => (only, None),
            ([], [(yaml, node), ..], _) => bail!(
                "{yaml}: {}.ros__parameters.model = {:?} matches none of the files {}",
                printable(&node.name),
                printable(&node.model),
                networks.iter().map(|(file, _)| *file).collect::<Vec<_>>().join(", ")
            ),
            _ => bail!(
                "several policies of this family: {}; name the folder of one",
                networks.iter().map(|(file, _)| *file).collect::<Vec<_>>().join(", ")
            ),
        };
        let (file, metadata) = network;
        let mut documents = vec![metadata_document(file, metadata)];
        if let Some(yaml) = yaml {
            documents.push(Document::read(bundle, yaml)?);
        }
        Ok(Some(Recognized { documents, networks: vec![(*file).to_owned()], others: Vec::new() }))
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let (meta, file) = (&found.documents[0], &found.networks[0]);
        let graph = Graph::of(file, &bundle.signature(file)?)?;
        let node = match found.documents.get(1) {
            None => None,
            Some(yaml) => {
                let fits = |node: &RosNode| file.rsplit('/').next() == node.model.rsplit('/').next();
                let node = RosNode::all(yaml)?.into_iter().find(fits);
                Some((yaml, node.with_context(|| format!("{}: no node's model is {file}", yaml.file))?))
            }
        };
        let ros = node.as_ref().map(|(yaml, node)| Ros { yaml, at: format!("{}.ros__parameters", node.name) });
        let robot = Robot::of(meta, ros.as_ref(), &graph, facts)?;

        let rate = match &ros {
            Some(ros) => {
                let path = ros.path("phase.control_dt");
                let dt = ros.yaml.number(&path)?;
                ensure!((1e-6..1e6).contains(&dt), "{} = {dt}: give the seconds of a tick", ros.yaml.location(&path));
                facts.note("rate_hz", ros.yaml.location(&path));
                1.0 / dt
            }
            None => facts.value("rate_hz")?.unwrap_or(50.0),
        };
        let mut parts = Parts::new("policy", rate);
        robot.describe(&mut parts);
        facts.note("joint order", robot.source.clone());
        facts.note("default", robot.default_source.clone());
        terms(&mut parts, meta, ros.as_ref(), &robot, &graph, facts)?;
        parts.network(file, &graph.input, &graph.output);
        target(&mut parts, &robot, ros.as_ref(), facts)?;
        Ok(parts.finish())
    }
}
