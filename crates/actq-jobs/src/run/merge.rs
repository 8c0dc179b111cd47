//! The job that puts the results of a plan into one, and the same for a part of them.

use std::path::Path;

use actq::error::{Error, Result};
use actq::measure::eval::ErrorSums;

use crate::error::JobError;
use crate::figures::{Driven, JobResult};
use crate::record::Outcome;
use crate::results::{Figures, Merged, MergedImage, MergedPolicy};
use crate::store::Results;
use crate::work::{Merge, Row};

/// Reads the result of a job by its address, and checks the file beside it.
pub type Read<'a> = &'a dyn Fn(&str) -> Result<Outcome, JobError>;

/// Merges the results of a plan, each read once by `read`.
///
/// # Errors
///
/// "Again" if a result is missing, "never" if one or its image is damaged.
pub fn merge(plan: &Merge, read: Read<'_>) -> Result<Merged, JobError> {
    let mut images: Vec<Vec<MergedImage>> = vec![Vec::new(); plan.policies.len()];
    for row in &plan.rows {
        let Some(of_policy) = images.get_mut(row.policy) else {
            let text = format!("{}: its policy is not in the list; plan again", row.image);
            return Err(JobError::never(Error::input(text)));
        };
        of_policy.push(image(row, read)?);
    }
    let policies = plan.policies.iter().zip(images).map(|(name, images)| MergedPolicy::new(name, images)).collect();
    Ok(Merged { clock_hz: plan.clock_hz, policies })
}

/// Merges the rows of a plan whose images and evaluations are all among the results; those without all of their
/// episodes count as not driven. Returns `None` if there is none.
///
/// # Errors
///
/// If the results are not of one plan.
pub fn merge_finished(plan: &Merge, results: &Results<'_>) -> Result<Option<Merged>, JobError> {
    let has_all = |addresses: &[String]| addresses.iter().all(|address| results.has(address));
    let finished = |row: &&Row| results.has(&row.image) && has_all(&row.evaluations);
    let drives = |row: &Row| if has_all(&row.drives) { row.drives.clone() } else { Vec::new() };
    let rows = plan.rows.iter().filter(finished).map(|row| Row { drives: drives(row), ..row.clone() });
    let finished = Merge { rows: rows.collect(), ..plan.clone() };
    if finished.rows.is_empty() {
        return Ok(None);
    }
    merge(&finished, &|address| results.get(address)).map(Some)
}

fn image(row: &Row, read: Read<'_>) -> Result<MergedImage, JobError> {
    let figures = match read(&row.image)? {
        Outcome::Made(made) => Some(figures(row, made, read)?),
        Outcome::Impossible(_) => None,
        _ => return Err(unexpected(&row.image)),
    };
    let Row { method, budget, seed, round, image, .. } = row.clone();
    Ok(MergedImage { method, budget, seed, round, address: image, made: figures })
}

fn figures(row: &Row, made: JobResult, read: Read<'_>) -> Result<Figures, JobError> {
    let mut sums: Option<ErrorSums> = None;
    for address in &row.evaluations {
        let Outcome::Evaluated(part) = read(address)? else { return Err(unexpected(address)) };
        match &mut sums {
            Some(sums) => sums.add(&part.sums)?,
            None => sums = Some(part.sums),
        }
    }
    let Some(sums) = sums else { return Err(unexpected(&row.image)) };
    let report = sums.report(made.bpw, made.bytes, Path::new("the held-out recording"))?;
    let mut driven: Option<Driven> = None;
    for address in &row.drives {
        let Outcome::Driven(part) = read(address)? else { return Err(unexpected(address)) };
        driven = Some(match driven {
            Some(whole) => whole.join(&part),
            None => part,
        });
    }
    Ok(Figures::new(made, report, driven))
}

fn unexpected(address: &str) -> JobError {
    let text = format!("{address}: the result has another kind than the plan needs; plan again");
    JobError::never(Error::input(text))
}
