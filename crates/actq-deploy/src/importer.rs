//! Policies with a description: the networks to quantize, and what is around them.

use std::fs;
use std::path::{Path, PathBuf};

use actq::data::Dataset;
use actq::error::{Context as _, Result, ensure};
use actq::import::Importer;
use actq::policy::Policy;
use ndarray::Array3;
use sha2::{Digest as _, Sha256};

use actq_onnx::Onnx;

use crate::bundle::Bundle;
use crate::compile::Deployment;
use crate::description::Description;
use crate::plan::Plan;
use crate::reading::DESCRIPTION;
use crate::run::Runner;

/// Importer of folders with a `deploy.toml`, as `actq import` writes them.
#[derive(Clone, Copy, Debug)]
pub struct DeployFolder;

impl Importer for DeployFolder {
    fn accepts(&self, path: &Path) -> bool {
        path.join(DESCRIPTION).is_file()
    }

    fn files(&self, path: &Path) -> Vec<PathBuf> {
        let text = fs::read_to_string(path.join(DESCRIPTION)).unwrap_or_default();
        let description = Description::parse(&text).ok();
        let named = description.iter().flat_map(Description::files).map(|file| path.join(file));
        // A network's file may name others, with its weights.
        let named = named.flat_map(|file| if Onnx.accepts(&file) { Onnx.files(&file) } else { vec![file] });
        [path.join(DESCRIPTION)].into_iter().chain(named).collect()
    }

    fn load(&self, path: &Path) -> Result<Policy> {
        Ok(Deployment::load(path)?.policy)
    }
}

impl Deployment {
    /// Reads `deploy.toml` and the files that it names from a folder.
    ///
    /// # Errors
    ///
    /// If a file is missing or damaged, if an image has no operations for a part of the description, or if an image
    /// differs from it.
    pub fn load(path: &Path) -> Result<Self> {
        let shown = path.join(DESCRIPTION);
        let shown = || shown.display().to_string();
        let bundle = Bundle::open(path)?;
        let text = bundle.text(DESCRIPTION)?;
        let description = Description::parse(&text).with_context(shown)?;
        let plan = Plan::new(&description, &bundle).with_context(shown)?;
        ensure!(
            description.name.len() <= 200,
            "{}: name has {} bytes; at most 200 are allowed",
            shown(),
            description.name.len()
        );
        let mut found = Self::new(&description.name, description.rate_hz as f32, &plan).with_context(shown)?;
        let mut digest = Sha256::new();
        digest.update(&text);
        for file in description.files() {
            let path = bundle.path(file)?;
            for path in if Onnx.accepts(&path) { Onnx.files(&path) } else { vec![path] } {
                digest.update(fs::read(&path).with_context(|| path.display().to_string())?);
            }
        }
        found.policy.digest = digest.finalize().into();
        found.policy.dir = path.to_owned();
        found.verify_on_draws(plan).with_context(shown)?;
        Ok(found)
    }
}

/// Makes a recording of what the networks of a folder read, of a recording of raw values; each episode begins with a
/// reset. The actions that are fed back are those of the f32 networks.
///
/// # Errors
///
/// If the folder cannot be read, or the recording's values are not its raw values.
pub fn observed(folder: &Path, raw: &Dataset) -> Result<Dataset> {
    let bundle = Bundle::open(folder)?;
    let description = Description::parse(&bundle.text(DESCRIPTION)?).context(DESCRIPTION)?;
    let plan = Plan::new(&description, &bundle).context(DESCRIPTION)?;
    let columns = Deployment::new(&description.name, description.rate_hz as f32, &plan)?.columns;
    let (len, given) = (plan.inputs().iter().map(|(_, len)| len).sum::<usize>(), raw.obs.dim().2);
    ensure!(given == len, "{}: it has {given} values a step, and the raw inputs {len}", raw.path.display());
    let mut runner = Runner::new(plan);
    let mut obs = Array3::zeros((raw.length.len(), raw.obs.dim().1, columns.len()));
    for (episode, steps) in raw.length.iter().enumerate() {
        runner.reset();
        for (step, values) in raw.episode(episode).take(*steps).enumerate() {
            let inputs = runner.plan().split(&values);
            let place = || format!("{}: episode {episode}, step {step}", raw.path.display());
            let tick = runner.step(&inputs).with_context(place)?;
            for (i, column) in columns.iter().enumerate() {
                obs[[episode, step, i]] = tick.observation[*column] as f32;
            }
        }
    }
    Ok(Dataset { path: raw.path.clone(), obs, action: None, length: raw.length.clone(), state: None })
}

/// Returns the targets of a folder's description for raw values, a row a tick, one tick after the other from a reset.
///
/// # Errors
///
/// If the folder cannot be read, a tick has another number of values, or a quaternion is not an orientation.
pub fn targets(folder: &Path, raw: &[Vec<f32>]) -> Result<Vec<Vec<f32>>> {
    let bundle = Bundle::open(folder)?;
    let description = Description::parse(&bundle.text(DESCRIPTION)?).context(DESCRIPTION)?;
    let plan = Plan::new(&description, &bundle).context(DESCRIPTION)?;
    let len: usize = plan.inputs().iter().map(|(_, len)| len).sum();
    let mut runner = Runner::new(plan);
    let tick = |(tick, values): (usize, &Vec<f32>)| {
        ensure!(values.len() == len, "tick {tick} has {} values, and the raw inputs {len}", values.len());
        let inputs = runner.plan().split(values);
        let found = runner.step(&inputs).with_context(|| format!("tick {tick}"))?;
        Ok(found.targets.iter().flat_map(|(_, values)| values.iter().map(|value| *value as f32)).collect())
    };
    raw.iter().enumerate().map(tick).collect()
}
