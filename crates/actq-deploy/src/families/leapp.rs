//! LEAPP: a YAML file that describes a pipeline of models with named ports, beside the models.

mod describe;
mod initial;
mod model;
mod pipeline;
mod targets;

use actq::error::{Context as _, Result, bail};

use self::describe::describe;
use self::pipeline::Pipeline;
use crate::bundle::Bundle;
use crate::description::Description;
use crate::document::Document;
use crate::facts::Facts;
use crate::family::{Family, Recognized};
use crate::yaml::Node;

/// Reader of LEAPP bundles.
#[derive(Debug)]
pub(super) struct Leapp;

const KEYS: [&str; 3] = ["models", "pipeline", "system information"];

impl Family for Leapp {
    fn profile(&self) -> &str {
        include_str!("leapp/profile.toml")
    }

    fn recognize(&self, bundle: &Bundle) -> Result<Option<Recognized>> {
        let mut documents = Vec::new();
        for file in bundle.with_ending("yaml") {
            // Only files with its keys can be of this family; the others need not be YAML that this reader knows.
            let has_keys = |text: &String| KEYS.iter().all(|key| text.contains(key));
            let Some(text) = bundle.text(file).ok().filter(has_keys) else { continue };
            let root = Node::parse(&text).context(file.to_owned())?;
            let document = Document::of(file, root.numbered());
            if KEYS.iter().all(|key| document.peek(key).is_some()) {
                documents.push(document);
            }
        }
        match &documents[..] {
            [] => Ok(None),
            [_] => Ok(Some(Recognized { documents, ..Recognized::default() })),
            [first, second, ..] => {
                bail!("several policies of this family: {} and {}; name the folder of one", first.file, second.file)
            }
        }
    }

    fn read(&self, bundle: &Bundle, found: &Recognized, facts: &mut Facts) -> Result<Description> {
        let yaml = &found.documents[0];
        let models = model::models(bundle, yaml)?;
        let pipeline = Pipeline::of(yaml, &models)?;
        describe(bundle, yaml, &models, &pipeline, facts)
    }
}
