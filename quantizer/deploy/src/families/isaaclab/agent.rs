//! `agent.yaml`: the configuration of the learner, which RSL-RL stores beside `env.yaml`.

use actq::error::{Result, bail};
use actq::text::printable;

use super::model::Given;
use crate::bundle::{Bundle, beside};
use crate::document::Document;
use crate::yaml::Node;

/// Facts about the policy in a learner's configuration.
#[derive(Debug, Default)]
pub(super) struct Agent {
    /// Limit of the action, which the learner's wrapper of the environment applies.
    pub(super) clip: Option<Given>,
    /// Group of observations that the policy reads, with its file and key.
    pub(super) group: Option<(String, String)>,
}

impl Agent {
    /// Reads the file beside an environment's, if there is one.
    pub(super) fn beside(bundle: &Bundle, environment: &Document) -> Result<Self> {
        let file = beside(&environment.file, "agent.yaml");
        if !bundle.has(&file) {
            return Ok(Self::default());
        }
        let yaml = Document::read(bundle, &file)?;
        let limit = |node: &Node| node.number().filter(|limit| *limit > 0.0);
        let limit = yaml.optional("clip_actions", "a number above 0, or null", limit)?;
        let clip = limit.map(|limit| Given { numbers: vec![limit], from: yaml.location("clip_actions") });
        // The network has another name in later versions.
        let path = ["obs_groups.actor", "obs_groups.policy"].into_iter().find(|path| yaml.peek(path).is_some());
        let group = match path.map(|path| Ok::<_, actq::error::Error>((path, yaml.texts(path)?))).transpose()? {
            None => None,
            Some((path, groups)) => match <[String; 1]>::try_from(groups) {
                Ok([group]) => Some((group, yaml.location(path))),
                Err(groups) => bail!(
                    "{}: the policy reads {} groups of observations ({}), and one is supported; write deploy.toml by docs/DEPLOY.md",
                    yaml.location(path),
                    groups.len(),
                    printable(&groups.join(", "))
                ),
            },
        };
        Ok(Self { clip, group })
    }
}
