//! Where a policy states its normalization: in the files of its processors, or in buffers beside its weights.

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use super::feature::{Feature, join};
use super::normalizer::{Eps, Mode, Normalizer};
use super::statistics::Statistics;
use crate::bundle::Bundle;
use crate::document::Document;
use crate::facts::Facts;
use crate::yaml::Node;

/// Files of the processors before and after a policy.
pub(super) const PROCESSORS: [&str; 2] = ["policy_preprocessor.json", "policy_postprocessor.json"];
/// Their steps that normalize.
const NORMALIZERS: [&str; 2] = ["normalizer_processor", "unnormalizer_processor"];
const WEIGHTS: &str = "model.safetensors";
/// Mode of a kind of features that no file names.
const IDENTITY: &str = "IDENTITY";
/// Key of the features that a step normalizes, if it does not normalize all.
const KEYS: &str = "config.normalize_observation_keys";

/// Returns a processor's file and its steps, each a document of its own.
pub(super) fn documents(bundle: &Bundle, file: &str) -> Result<Vec<Document>> {
    let whole = Document::read(bundle, file)?;
    let steps = whole.required("steps", "a list of steps", |node| (!node.items().is_empty()).then(|| node.items()))?;
    let step = |(i, step): (usize, &Node)| Document::of(&format!("{file} step {i}"), step.clone());
    let mut all: Vec<Document> = steps.iter().enumerate().map(step).collect();
    all.push(whole);
    Ok(all)
}

/// A policy's normalization.
pub(super) enum Normalization<'a> {
    /// Steps before and after the policy.
    Steps([Step<'a>; 2]),
    /// Buffers beside the weights.
    Buffers(Statistics),
}

/// A step that normalizes.
pub(super) struct Step<'a> {
    document: &'a Document,
    statistics: Statistics,
}

impl<'a> Normalization<'a> {
    /// Finds it in the policy's folder.
    pub(super) fn of(bundle: &Bundle, folder: &str, documents: &'a [Document]) -> Result<Self> {
        let weights = join(folder, WEIGHTS);
        let buffers = bundle.has(&weights).then(|| Statistics::of_weights(bundle, &weights)).transpose()?;
        let buffers = buffers.filter(|buffers| buffers.first().is_some());
        let files = PROCESSORS.map(|file| join(folder, file));
        let missing: Vec<&String> = files.iter().filter(|file| !bundle.has(file)).collect();
        match (&missing[..], buffers) {
            ([], Some(buffers)) => Err(Facts::contradiction(
                "normalization",
                (&files[0], "that a processor normalizes"),
                (
                    &weights,
                    &format!("by {:?} that the policy itself does", printable(buffers.first().unwrap_or_default())),
                ),
            )),
            ([], None) => {
                let step = |i: usize| Step::of(bundle, folder, documents, &files[i], NORMALIZERS[i]);
                Ok(Self::Steps([step(0)?, step(1)?]))
            }
            ([_, _], Some(buffers)) => Ok(Self::Buffers(buffers)),
            ([file, ..], _) => bail!(
                "there is no {file}, and no {weights} with normalize_inputs.* as older policies have: copy the file from the \
                 policy's folder, where LeRobot saves it with config.json"
            ),
        }
    }

    /// Returns the normalization of a feature, which is an observation or the action.
    pub(super) fn normalizer(&self, feature: &Feature, config: &Document, facts: &mut Facts) -> Result<Normalizer> {
        let path = format!("normalization_mapping.{}", feature.kind);
        let stated = config.optional(&path, "a text", Node::text)?.unwrap_or(IDENTITY);
        let (mode, source, eps, statistics) = match self {
            Self::Steps([before, after]) => {
                let step = if feature.is_action() { after } else { before };
                let (mode, source) = step.mode(feature)?;
                if config.peek("normalization_mapping").is_some() && stated != mode {
                    return Err(Facts::contradiction(
                        &format!("normalization of {:?}", printable(&feature.name)),
                        (&config.location(&path), &printable(stated)),
                        (&source, &printable(mode)),
                    ));
                }
                step.check_shape(feature)?;
                let eps = step.document.number("config.eps")?;
                match step.excludes(feature)? {
                    true => (IDENTITY, step.document.location(KEYS), eps, &step.statistics),
                    false => (mode, source, eps, &step.statistics),
                }
            }
            Self::Buffers(statistics) => {
                let eps = if stated == IDENTITY { None } else { facts.value("buffers.eps")? };
                (stated, config.location(&path), eps.unwrap_or(1e-8), statistics)
            }
        };
        ensure!((0.0..1.0).contains(&eps), "eps = {eps} of {source}: give a number from 0 to below 1");
        let mode = Mode::parse(mode, &source)?;
        let rule = if matches!(self, Self::Steps(_)) { "range.eps" } else { "buffers.range.eps" };
        let added = matches!(mode, Mode::Range(_)) && facts.value::<String>(rule)?.as_deref() == Some("all");
        Normalizer::of(feature, mode, Eps { value: eps, added }, statistics, &source)
    }
}

impl<'a> Step<'a> {
    /// Finds the step `wanted` of a processor's file; the other steps must change no number.
    fn of(bundle: &Bundle, folder: &str, documents: &'a [Document], file: &str, wanted: &str) -> Result<Self> {
        let mut found = None;
        for step in documents.iter().filter(|document| document.file.starts_with(&format!("{file} step "))) {
            let name = step.required("registry_name", "the name of a step that LeRobot registers", Node::text)?;
            if step.peek("config").is_some_and(|config| config.entries().is_empty()) {
                step.node("config");
            }
            match name {
                _ if name == wanted => {
                    ensure!(found.is_none(), "{}: a second {wanted}; remove one", step.file);
                    found = Some(step);
                }
                // Renamed observations keep their values: raw inputs have the policy's names.
                "rename_observations_processor" | "to_batch_processor" => {}
                "device_processor" => {
                    let dtype = step.optional("config.float_dtype", "a text", Node::text)?;
                    ensure!(
                        matches!(dtype, None | Some("float32" | "float")),
                        "{} = {:?}: only float32 is supported",
                        step.location("config.float_dtype"),
                        printable(dtype.unwrap_or_default())
                    );
                }
                _ => bail!(
                    "{}: {:?} is not supported; remove the step, and compute it in the application",
                    step.location("registry_name"),
                    printable(name)
                ),
            }
        }
        let document = found.with_context(|| format!("{file}: none of its steps is {wanted}"))?;
        let stats = document.peek("config.stats").filter(|stats| !stats.is_null());
        ensure!(
            stats.is_none(),
            "{}: it takes the place of the state_file; remove it, and save the statistics in the state_file",
            document.location("config.stats")
        );
        let statistics = match document.optional("state_file", "the name of a file", Node::text)? {
            None => Statistics::none(&document.file),
            Some(state) => {
                // The name alone must not leave the bundle.
                bundle.path(state).with_context(|| document.location("state_file"))?;
                let state = join(folder, state);
                ensure!(
                    bundle.has(&state),
                    "{}: there is no file {:?}",
                    document.location("state_file"),
                    printable(&state)
                );
                Statistics::of_processor(bundle, &state)?
            }
        };
        Ok(Self { document, statistics })
    }

    /// Returns the mode of a feature's type, and where it is.
    fn mode(&self, feature: &Feature) -> Result<(&'a str, String)> {
        let path = format!("config.norm_map.{}", feature.kind);
        let mode = self.document.optional(&path, "a text", Node::text)?.unwrap_or(IDENTITY);
        Ok((mode, self.document.location(&path)))
    }

    /// Returns `true` if the step normalizes other observations only.
    fn excludes(&self, feature: &Feature) -> Result<bool> {
        let keys = self.document.optional(KEYS, "a list of texts", Node::texts)?;
        Ok(keys.is_some_and(|keys| !feature.is_action() && !keys.contains(&feature.name)))
    }

    /// Compares a feature with that of the step.
    fn check_shape(&self, feature: &Feature) -> Result<()> {
        let path = format!("config.features.{}.shape", feature.name);
        let shape = self.document.optional(&path, "a list of lengths", Node::numbers)?;
        if shape.as_deref() == Some(&[feature.len as f64]) || (shape.is_none() && feature.is_action()) {
            return Ok(());
        }
        let shape = shape.map_or("that there is no such feature".to_owned(), |shape| format!("{shape:?}"));
        Err(Facts::contradiction(
            &format!("shape of {:?}", printable(&feature.name)),
            (&feature.at, &format!("[{}]", feature.len)),
            (&self.document.location(&path), &shape),
        ))
    }
}
