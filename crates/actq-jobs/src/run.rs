//! Runs one job.

mod custom;
mod drive;
mod images;
mod inputs;
mod merge;

use std::path::Path;

use actq::data::Sizes;
use actq::error::ensure;
use actq::measure::eval::ErrorSums;
use actq::measure::recorded;

use crate::error::JobError;
use crate::figures::Evaluated;
use crate::host::Host;
use crate::job::{Job, version};
use crate::record::{FORMAT, Outcome, Record};
use crate::store::Store;
use crate::work::{self, Work};
use inputs::{Kept, check_inputs, heldout, image, path_of};
pub use merge::{Read, merge, merge_finished};

/// Runs a job and writes its result into the store, in place of a damaged one. Returns `false` if the store has the
/// whole result already. `watch` receives the present work and the share of it that is done.
///
/// # Errors
///
/// [`JobError::again`] is `true` if another try may succeed. The store then has no part of the result.
pub fn run(job: &Job, store: &Store, host: &dyn Host, watch: &mut dyn FnMut(&str, f64)) -> Result<bool, JobError> {
    if store.has(&job.address) {
        return Ok(false);
    }
    let mut work = || -> Result<(), JobError> {
        check_inputs(&job.inputs)?;
        let (result, kept) = match &job.work {
            Work::Quantize(make) => images::quantize(job, make, store, host, watch)?,
            Work::Learn(learn) => images::learn(job, learn, store, host, watch)?,
            Work::Evaluate(evaluate) => (self::evaluate(job, evaluate, store, host)?, None),
            Work::Drive(drive) => drive::drive(job, drive, store, host)?,
            Work::Merge(merge) => (Outcome::Merged(self::merge(merge, &|address| store.read_whole(address))?), None),
            Work::Custom(work) => custom::custom(job, work, store, host, watch)?,
        };
        let record = Record { format: FORMAT, address: job.address.clone(), version: version(), result };
        let blob = kept.as_ref().map(|Kept { path, bytes }| (path.as_path(), &bytes[..]));
        store.write_result(&record, blob, host)
    };
    work().map_err(|error| error.context(job.title.clone()))?;
    Ok(true)
}

fn evaluate(job: &Job, evaluate: &work::Evaluate, store: &Store, host: &dyn Host) -> Result<Outcome, JobError> {
    let buffer = match image(&evaluate.image, store)? {
        Ok((_, buffer)) => buffer,
        Err(why) => return Ok(Outcome::Impossible(why)),
    };
    let measure = || {
        let policy = host.load(path_of(evaluate.policy.as_deref())?)?;
        let mut dataset = heldout(job, Sizes::of(&policy))?;
        // `actq sweep` says how they differ.
        recorded::use_policy_of(&mut dataset, &policy.graph);
        dataset.fill_actions(&policy.graph);
        let [first, count] = [evaluate.episodes.first, evaluate.episodes.count].map(|n| n as usize);
        let end = first.saturating_add(count);
        ensure!(end <= dataset.length.len(), "{}: has no episode {}", dataset.path.display(), end.saturating_sub(1));
        let sums = ErrorSums::of(buffer.image(Path::new(&evaluate.image))?, &dataset, first..end)?;
        Ok(Outcome::Evaluated(Evaluated { episodes: evaluate.episodes, sums }))
    };
    Ok(measure()?)
}
