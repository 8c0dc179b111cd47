//! Jobs that make an image.

use actq::budget::Budget;
use actq::data::{Dataset, Learned, Recordings, Sizes};
use actq::emit::Core;
use actq::error::{Cause, Error, Result};
use actq::measure::recorded;
use actq::measure::time::{CLOCK, StepTime};
use actq::methods::Outcome as MatrixOutcome;
use actq::pipeline::Quantizer;
use actq::policy::Policy;

use super::inputs::{self, Kept, path_of};
use crate::digest::of_bytes;
use crate::error::JobError;
use crate::figures::{Driven, JobResult};
use crate::host::Host;
use crate::job::{Input, Job, Role};
use crate::record::Outcome;
use crate::store::Store;
use crate::work::{Learn, Make};

/// Makes an image of the recordings in the policy's folder.
pub(super) fn quantize(
    job: &Job,
    make: &Make,
    store: &Store,
    host: &dyn Host,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome, Option<Kept>), JobError> {
    let policy = host.load(path_of(make.policy.as_deref())?)?;
    let parts = calib(job, &policy, host)?;
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
    let mut parts = calib(job, &policy, host)?;
    for address in &learn.recordings {
        let path = store.recording(address);
        match store.read(address)? {
            Outcome::Driven(Driven { recording: Some(sha256), .. }) => drop(store.read_blob(&path, &sha256)?),
            Outcome::Impossible(why) => return Ok((Outcome::Impossible(why), None)),
            _ => {
                let text = format!("{address}: the result has no recording to learn from");
                return Err(JobError::never(Error::input(text)));
            }
        }
        parts.push(Dataset::load(&path, Sizes::of(&policy))?);
    }
    made(job, &learn.make, &policy, parts, store, host, watch)
}

/// Reads the recordings to learn from, if the job has any.
fn calib(job: &Job, policy: &Policy, host: &dyn Host) -> Result<Vec<Dataset>> {
    let read = |input: &Input| match input.role {
        Role::Calib => Some(Dataset::load(&input.path, Sizes::of(policy))),
        Role::Recorded => Some(host.recorded(policy, &input.path)),
        Role::Policy | Role::Heldout | Role::Command => None,
    };
    job.inputs.iter().filter_map(read).collect()
}

/// Returns `true` for an error that says that no image is within the budget.
fn is_impossible(error: &Error, budget: Budget) -> bool {
    let searches = matches!(budget, Budget::ImageBytes(_) | Budget::MaxNmse(_) | Budget::Time(_));
    error.budget().is_some() || (searches && matches!(error.cause(), Cause::Input(_)))
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
    let heldout = match job.inputs.iter().any(|input| input.role == Role::Heldout) {
        true => Some(inputs::heldout(job, Sizes::of(policy))?),
        false => None,
    };
    let mut recordings = Recordings { calib: learned, heldout };
    recorded::use_policy(&mut recordings, &policy.graph);
    recordings.fill_actions(&policy.graph);
    let frames = recordings.calib.as_ref().map_or(0, Dataset::frames);
    let options = make.options(method)?;
    let quantizer = Quantizer::new(policy, &recordings, options.method.clone(), None, |share| {
        watch("calibrating", share);
    })?;
    let quantized = match quantizer.quantize(&options, watch) {
        Ok(made) => made,
        // The reason is a result, too: another try gives it again.
        Err(error) if is_impossible(&error, make.budget) => return Ok((Outcome::Impossible(error.to_string()), None)),
        Err(error) => return Err(error.into()),
    };
    let buffer = quantized.buffer();
    let image = buffer.image(&store.image(&job.address))?;
    let result = JobResult {
        image: of_bytes(&quantized.image),
        bytes: image.bytes(),
        cycles: StepTime::new(&image, Core::M4f, CLOCK).cycles,
        bpw: actq::measure::size::bits_per_weight(&image),
        steps: quantized.steps(),
        frames,
        matrices: policy.graph.matrices.iter().map(|matrix| matrix.name.clone()).collect(),
        rows: quantized.outcomes.iter().map(MatrixOutcome::trained_rows).collect(),
        scores: quantizer.method().scores(),
    };
    let kept = Kept { path: store.image(&job.address), bytes: quantized.image };
    Ok((Outcome::Made(result), Some(kept)))
}
