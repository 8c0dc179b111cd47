//! The job that puts the results of a plan into one, and the same for a part of them.

use std::path::Path;

use actq::error::{Error, Result};
use actq::measure::eval::ErrorSums;

use crate::error::JobError;
use crate::figures::{Driven, Made};
use crate::merged::{Figures, Merged, MergedImage, MergedPolicy};
use crate::record::Outcome;
use crate::store::Store;
use crate::work::{Merge, Row};

/// Merges the results of a plan, which must be in the store.
///
/// # Errors
///
/// "Again" if a result is missing, "never" if one or its image is damaged.
pub fn merge(plan: &Merge, store: &Store) -> Result<Merged, JobError> {
    let mut images: Vec<Vec<MergedImage>> = vec![Vec::new(); plan.policies.len()];
    for row in &plan.rows {
        let Some(of_policy) = images.get_mut(row.policy) else {
            let text = format!("{}: its policy is not in the list; plan again", row.image);
            return Err(JobError::never(Error::input(text)));
        };
        of_policy.push(image(row, store)?);
    }
    let policies = plan.policies.iter().zip(images).map(|(name, images)| MergedPolicy::new(name, images)).collect();
    Ok(Merged { clock_hz: plan.clock_hz, policies })
}

/// Merges the rows of a plan whose images and evaluations are all in the store, and whole; those without all of their
/// episodes count as not driven. Returns `None` if there is none.
///
/// # Errors
///
/// If the results are not of one plan.
pub fn merge_finished(plan: &Merge, store: &Store) -> Result<Option<Merged>, JobError> {
    let finished = |row: &Row| {
        let has_all = |addresses: &[String]| addresses.iter().all(|address| store.has(address));
        let drives = if has_all(&row.drives) { row.drives.clone() } else { Vec::new() };
        (store.has(&row.image) && has_all(&row.evaluations)).then(|| Row { drives, ..row.clone() })
    };
    let rows: Vec<Row> = plan.rows.iter().filter_map(finished).collect();
    if rows.is_empty() {
        return Ok(None);
    }
    merge(&Merge { rows, ..plan.clone() }, store).map(Some)
}

fn image(row: &Row, store: &Store) -> Result<MergedImage, JobError> {
    let figures = match store.read_whole(&row.image)? {
        Outcome::Made(made) => Some(figures(row, made, store)?),
        Outcome::Impossible(_) => None,
        _ => return Err(unexpected(&row.image)),
    };
    let Row { method, budget, seed, round, image, .. } = row.clone();
    Ok(MergedImage { method, budget, seed, round, address: image, made: figures })
}

fn figures(row: &Row, made: Made, store: &Store) -> Result<Figures, JobError> {
    let mut sums: Option<ErrorSums> = None;
    for address in &row.evaluations {
        let Outcome::Evaluated(part) = store.read(address)? else { return Err(unexpected(address)) };
        match &mut sums {
            Some(sums) => sums.add(&part.sums)?,
            None => sums = Some(part.sums),
        }
    }
    let Some(sums) = sums else { return Err(unexpected(&row.image)) };
    let report = sums.report(made.bpw, made.bytes, Path::new("the held-out recording"))?;
    let mut driven: Option<Driven> = None;
    for address in &row.drives {
        let Outcome::Driven(part) = store.read(address)? else { return Err(unexpected(address)) };
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
