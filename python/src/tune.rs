//! On-policy rounds whose rollouts are Python's.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use actq::budget::Budget;
use actq::data::{Dataset, Recordings, Sizes};
use actq::error::{Context as _, Error};
use actq::methods::{Activations, Method, Options};
use actq::pipeline::driven::{DriveOutcome, Driven};
use actq::pipeline::tune::{TunePlan, run};
use actq::pipeline::{self, check_budget};
use actq::runtime::ImageBuffer;
use actq_cli::report::tuned;
use actq_kernels::Width;
use pyo3::prelude::*;

use crate::error::{OrRaise as _, error, given};
use crate::image::Image;
use crate::policy::Policy;
use crate::quantize::Request;
use crate::recordings::{Passed, passed};
use crate::work;

/// Makes an image for the rollouts of the f32 policy: 8 bits, int16 activations, which need no recording.
#[pyfunction]
pub(crate) fn stand_in(py: Python<'_>, #[pyo3(from_py_with = given)] policy: PyRef<'_, Policy>) -> PyResult<Image> {
    let options = Options {
        group: Method::Rtn.default_group(),
        activations: Activations::Int16,
        ..Options::new(Method::Rtn, Budget::Width(Width::W8))
    };
    let policy = Arc::clone(&policy.policy);
    let made = py.detach(|| pipeline::quantize(&policy, &Recordings::default(), &options, ())).or_raise()?;
    Image::of(made.buffer(), Path::new("image"))
}

/// The last image, those of all rounds, the rounds as JSON, the table of `actq tune`, and the round whose image had the
/// most success if it is not the last, and warnings of recorded actions that are not the policy's.
type Outcome = (Image, Vec<Image>, String, String, Option<usize>, Vec<String>);

/// Quantizes in rounds. `rollout(round, image)` returns the recordings of a rollout, and its outcome as JSON.
#[pyfunction]
#[pyo3(signature = (policy, recordings, heldout, request, rounds, rollout, progress))]
#[expect(clippy::too_many_arguments, reason = "only the package's own Python calls it")]
pub(crate) fn tune(
    py: Python<'_>,
    #[pyo3(from_py_with = given)] policy: PyRef<'_, Policy>,
    recordings: &Bound<'_, PyAny>,
    heldout: Option<&Bound<'_, PyAny>>,
    #[pyo3(from_py_with = given)] request: Request,
    #[pyo3(from_py_with = given)] rounds: usize,
    rollout: Py<PyAny>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let (calib, heldout) = (passed(Some(recordings), "recordings")?, passed(heldout, "heldout")?);
    if !(1..=100).contains(&rounds) {
        return Err(error!("rounds is {rounds}; use 1 to 100 rounds"));
    }
    if policy.policy.around.is_some() {
        return Err(error!(
            "{}: rounds with a deploy.toml are not supported yet; record, and pass the recordings to quantize",
            policy.policy.name
        ));
    }
    let options = request.options(&policy.policy.graph, Method::Distill)?;
    let (policy, rollout) = (policy.policy.clone(), Arc::new(rollout));
    let (tuned, images) = work::run(py, progress, move |worker| {
        check_budget(&policy, &options)?;
        let sizes = Sizes::of(&policy);
        let load = |passed: Vec<Passed>| passed.into_iter().map(|p| p.load(sizes)).collect::<Result<Vec<_>, _>>();
        let (calib, mut heldout) = (load(calib)?, load(heldout)?);
        let heldout = match heldout.len() {
            0 => None,
            1 => heldout.pop(),
            _ => Some(actq::data::joined(&heldout, sizes.state)?),
        };
        let plan = TunePlan { policy: &policy, calib, heldout, options: &options, rounds };
        let mut images = Vec::new();
        let drive = |round: usize, image: &[u8]| {
            worker.report(&format!("round {round}: rollout"), 0.0);
            images.push(image.to_vec());
            let (rollout, image) = (rollout.clone(), image.to_vec());
            let (passed, outcome) = worker.call(move |py| {
                let image = Image::of(ImageBuffer::new(&image), &PathBuf::from(format!("round {round}")))?;
                let (recordings, outcome): (Bound<'_, PyAny>, String) =
                    rollout.call1(py, (round, image))?.extract(py)?;
                Ok((passed(Some(&recordings), &format!("rollout {round}"))?, outcome))
            });
            let recordings = passed.into_iter().map(|p| p.load(sizes)).collect::<Result<Vec<Dataset>, Error>>()?;
            let outcome = DriveOutcome::parse(&outcome).context("the outcome of a rollout is not a JSON object")?;
            Ok(Driven { recordings, outcome })
        };
        let tuned = run(plan, drive, |work: &str, share| worker.report(work, share))?;
        Ok((tuned, images))
    })?;
    let image = |bytes: &Vec<u8>| Image::of(ImageBuffer::new(bytes), Path::new("image"));
    let rounds = serde_json::to_string(&tuned.rounds).or_raise()?;
    let better = tuned.better().map(|round| round.round);
    Ok((
        image(&tuned.quantized.image)?,
        images.iter().map(image).collect::<PyResult<_>>()?,
        rounds,
        tuned::table(&tuned),
        better,
        tuned.differences.iter().map(ToString::to_string).collect(),
    ))
}
