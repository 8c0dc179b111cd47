//! Jobs that make an image.

use std::collections::BTreeMap;

use actq::budget::Budget;
use actq::data::{Dataset, Learned, Recordings, Sizes};
use actq::error::Result;
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::{Method, Options, Outcome as MatrixOutcome};
use actq::pipeline::{QuantizedPolicy, Quantizer};
use actq::policy::Policy;

use super::inputs::{Kept, path_of};
use crate::digest::of_bytes;
use crate::error::JobError;
use crate::figures::{Driven, Made};
use crate::host::Host;
use crate::job::{Job, Learn, Make, Role};
use crate::record::Outcome;
use crate::store::Store;

/// Makes an image of the recordings in the policy's folder.
pub(super) fn quantize(
    job: &Job,
    make: &Make,
    store: &Store,
    host: &dyn Host,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome, Option<Kept>), JobError> {
    let policy = host.load(path_of(make.policy.as_deref())?)?;
    let parts = calib(job, &policy)?;
    made(job, make, &policy, parts, store, host, watch)
}

/// Makes an image that also learns from rollouts of earlier ones.
pub(super) fn learn(
    job: &Job,
    learn: &Learn,
    store: &Store,
    host: &dyn Host,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome, Option<Kept>), JobError> {
    let policy = host.load(path_of(learn.make.policy.as_deref())?)?;
    let mut parts = calib(job, &policy)?;
    for address in &learn.recordings {
        let path = store.recording(address);
        match store.read(address)? {
            Outcome::Driven(Driven { recording: Some(sha256), .. }) => drop(store.read_blob(&path, &sha256)?),
            Outcome::Impossible(why) => return Ok((Outcome::Impossible(why), None)),
            _ => {
                let text = format!("{address}: the result has no recording to learn from");
                return Err(JobError::never(actq::error::Error::input(text)));
            }
        }
        parts.push(Dataset::load(&path, Sizes::of(&policy))?);
    }
    made(job, &learn.make, &policy, parts, store, host, watch)
}

/// Reads the recording to learn from, if the job has one.
fn calib(job: &Job, policy: &Policy) -> Result<Vec<Dataset>> {
    let files = job.inputs.iter().filter(|input| input.role == Role::Calib);
    files.map(|input| Dataset::load(&input.path, Sizes::of(policy))).collect()
}

fn made(
    job: &Job,
    make: &Make,
    policy: &Policy,
    mut parts: Vec<Dataset>,
    store: &Store,
    host: &dyn Host,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome, Option<Kept>), JobError> {
    let method = host.method(&make.method)?;
    let learned = if parts.is_empty() { None } else { Some(Learned::join(&mut parts, &policy.graph)?.dataset) };
    let mut recordings = Recordings { calib: learned, heldout: None };
    recordings.fill_actions(&policy.graph);
    let frames = recordings.calib.as_ref().map_or(0, Dataset::frames);
    let (quantized, scores) = match image(make, method, policy, &recordings, watch) {
        Ok(made) => made,
        // The reason is a result, too: another try gives it again.
        Err(error) if error.budget().is_some() => return Ok((Outcome::Impossible(error.to_string()), None)),
        Err(error) => return Err(error.into()),
    };
    let buffer = quantized.buffer();
    let image = buffer.image(&store.image(&job.address))?;
    let result = Made {
        image: of_bytes(&quantized.image),
        bytes: image.bytes(),
        cycles: StepTime::new(&image, CLOCK).cycles,
        bpw: actq::measure::size::bits_per_weight(&image),
        steps: quantized.steps(),
        frames,
        matrices: policy.graph.matrices.iter().map(|matrix| matrix.name.clone()).collect(),
        rows: quantized.outcomes.iter().map(MatrixOutcome::trained_rows).collect(),
        scores,
    };
    let kept = Kept { path: store.image(&job.address), bytes: quantized.image };
    Ok((Outcome::Made(result), Some(kept)))
}

type Scores = Vec<BTreeMap<String, f64>>;

fn image(
    make: &Make,
    method: Method,
    policy: &Policy,
    recordings: &Recordings,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(QuantizedPolicy, Scores)> {
    let Make { bpw, steps, relative, seed, .. } = *make;
    let plain = Options::new(method, Budget::BitsPerWeight(bpw));
    let options = Options { group: plain.method.default_group(), steps, relative, seed, ..plain };
    options.check()?;
    let quantizer = Quantizer::new(policy, recordings, options.method.clone(), None, |share| {
        watch("calibrating", share);
    })?;
    let quantized = quantizer.quantize(&options, watch)?;
    let scores = quantizer.method().scores();
    Ok((quantized, scores))
}
