//! Vectors that a policy reads or gives, by its configuration.

use actq::error::{Result, bail, ensure};
use actq::text::printable;

use super::super::common::count;
use crate::document::Document;
use crate::yaml::Node;

/// Keys that only LeRobot's configurations have: the observations and the actions.
pub(super) const KEYS: [&str; 2] = ["input_features", "output_features"];

/// A vector that the policy reads or gives.
#[derive(Debug)]
pub(super) struct Feature {
    pub(super) name: String,
    /// LeRobot's `FeatureType`.
    pub(super) kind: String,
    pub(super) len: usize,
    /// File and key, for reports and errors.
    pub(super) at: String,
}

impl Feature {
    /// Reads the observations, all of which must be vectors.
    pub(super) fn observations(config: &Document) -> Result<Vec<Self>> {
        let section = KEYS[0];
        let features: Vec<Self> =
            config.keys(section).into_iter().map(|name| Self::of(config, section, name)).collect::<Result<_>>()?;
        ensure!(!features.is_empty(), "{}: it has no features; the policy must read a state", config.location(section));
        for feature in &features {
            ensure!(
                ["STATE", "ENV"].contains(&feature.kind.as_str()),
                "{}: the type {:?} is not supported; STATE and ENV are",
                feature.at,
                printable(&feature.kind)
            );
        }
        Ok(features)
    }

    pub(super) fn action(config: &Document) -> Result<Self> {
        let section = KEYS[1];
        let names = config.keys(section);
        let [name] = names[..] else {
            bail!(
                "{}: it has {} features; a policy with the only one \"action\" is supported",
                config.location(section),
                names.len()
            )
        };
        let feature = Self::of(config, section, name)?;
        ensure!(
            feature.is_action() && feature.kind == "ACTION",
            "{}: the only output must be \"action\" of the type ACTION",
            feature.at
        );
        Ok(feature)
    }

    fn of(config: &Document, section: &str, name: &str) -> Result<Self> {
        let path = format!("{section}.{name}");
        let kind = config.required(&format!("{path}.type"), "a text", Node::text)?.to_owned();
        let shape_path = format!("{path}.shape");
        let shape = config.required(&shape_path, "a list of lengths above 0", lengths)?;
        let at = config.location(&path);
        ensure!(
            kind != "VISUAL",
            "{at} is an image {shape:?}, whose encoder does not run on a microcontroller. Export the network behind the encoder, \
             and declare what it reads as features of the type STATE, which the application computes; or train a policy of states"
        );
        let [len] = shape[..] else { bail!("{} = {shape:?}: give one length", config.location(&shape_path)) };
        Ok(Self { name: name.to_owned(), kind, len, at })
    }

    pub(super) fn is_action(&self) -> bool {
        self.name == "action"
    }

    /// Returns its name without points, which separate networks from outputs in a description.
    pub(super) fn plain(&self) -> String {
        self.name.replace('.', "_")
    }
}

fn lengths(node: &Node) -> Option<Vec<usize>> {
    node.items().iter().map(|item| count(item).filter(|len| *len > 0)).collect()
}

/// Returns the path of a file in a folder of the bundle; that of the bundle itself is empty.
pub(super) fn join(folder: &str, file: &str) -> String {
    if folder.is_empty() { file.to_owned() } else { format!("{folder}/{file}") }
}
