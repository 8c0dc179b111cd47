//! The works of a comparison's jobs.

use std::path::Path;
use std::{env, fs};

use actq::import::FILES;
use actq_cli::outputs::unfinished::Scratch;
use actq_jobs::host::{Found, Needed};
use actq_jobs::job::{Job, Role};
use actq_jobs::work::Custom;
use anyhow::{Context as _, Result, bail};
use serde_json::Value;

use super::actquant_k;
use super::cell::Attempted;
use super::cell_image::{Attempt, Maker, Subject};
use super::jobs::{DRIVE, Driving, MAKE, Making};
use super::simulator::{Driver, Episodes, Simulator, shared};

/// Does a job of a comparison.
///
/// # Errors
///
/// If the policy cannot be read, a method fails, or a simulator does.
pub fn work(job: &Job, work: &Custom, needs: &[Needed], watch: &mut dyn FnMut(&str, f64)) -> Result<Found> {
    let input = job.inputs.iter().find(|input| input.role == Role::Policy).context("the job has no policy")?;
    let folder = input.path.parent().context("the policy has no folder")?;
    let options = work.options.clone();
    match work.name.as_str() {
        MAKE => make(folder, &serde_json::from_value(options)?, watch),
        DRIVE => drive(folder, &serde_json::from_value(options)?, needs.first()),
        name => bail!("{name:?} is no work of a comparison"),
    }
}

fn make(folder: &Path, making: &Making, watch: &mut dyn FnMut(&str, f64)) -> Result<Found> {
    let subject = Subject::load(folder)?;
    let mut maker = Maker::new(&subject, making.steps, making.seed);
    let (made, why, file) = match maker.make(making.method, making.budget, watch)? {
        Attempt::Made(image, made) => (Some(made), None, Some(("actq", image))),
        Attempt::Simulated(graph, made) => {
            (Some(made), None, Some(("safetensors", actquant_k::tensors(maker.policy(), &graph)?)))
        }
        Attempt::Undriven(made) => (Some(made), None, None),
        Attempt::Impossible(why) => (None, Some(why), None),
    };
    Ok(Found { value: serde_json::to_value(Attempted { made, why })?, file })
}

fn drive(folder: &Path, driving: &Driving, made: Option<&Needed>) -> Result<Found> {
    let simulator = Simulator::of(&driving.policy, shared()?.as_deref());
    let scratch = Scratch::new().context("cannot create a temporary folder")?;
    let driver = match made.map(|made| made.file.as_deref()) {
        None => Driver::Folder(folder.to_owned()),
        // No image is within the budget.
        Some(None) => return Ok(Found { value: Value::Null, file: None }),
        Some(Some(image)) if image.extension().is_some_and(|ending| ending == "actq") => {
            Driver::Image(image.to_owned())
        }
        Some(Some(weights)) => {
            let [json, tensors] = FILES.map(|name| scratch.path().join(name));
            for (from, to) in [(folder.join(FILES[0]), json), (weights.to_owned(), tensors)] {
                fs::copy(&from, to).with_context(|| format!("{}: cannot copy the file", from.display()))?;
            }
            Driver::Folder(scratch.path().to_owned())
        }
    };
    // The comparison puts the command beside this one.
    let program = env::current_exe().context("cannot find the running executable")?;
    let actq = program.with_file_name(format!("actq{}", env::consts::EXE_SUFFIX));
    let outcome = simulator.run(&driver, Episodes { first: driving.first, count: driving.count }, &actq)?;
    let outcome = outcome.with_context(|| format!("{} has no simulator here", driving.policy))?;
    Ok(Found { value: serde_json::to_value(outcome)?, file: None })
}
