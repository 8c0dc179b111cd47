//! The job that puts the results of a plan into one.

use std::path::Path;

use actq::error::{Error, Result};
use actq::measure::eval::ErrorSums;

use crate::error::JobError;
use crate::figures::{Driven, Made};
use crate::job::{Merge, Row};
use crate::merged::{Figures, Merged, MergedImage, MergedPolicy};
use crate::record::Outcome;
use crate::store::Store;

/// Merges the results of a plan, which must be in the store.
///
/// # Errors
///
/// "Again" if a result is missing.
pub(super) fn merge(plan: &Merge, store: &Store) -> Result<Merged, JobError> {
    let mut policies: Vec<MergedPolicy> = plan.policies.iter().map(|name| MergedPolicy::of(name)).collect();
    for row in &plan.rows {
        let Some(policy) = policies.get_mut(row.policy) else {
            let text = format!("{}: its policy is not in the list; plan again", row.image);
            return Err(JobError::never(Error::input(text)));
        };
        policy.images.push(image(row, store)?);
    }
    policies.iter_mut().for_each(MergedPolicy::find_frontiers);
    Ok(Merged { policies })
}

fn image(row: &Row, store: &Store) -> Result<MergedImage, JobError> {
    let figures = match store.read(&row.image)? {
        Outcome::Made(made) => Some(figures(row, made, store)?),
        Outcome::Impossible(_) => None,
        _ => return Err(unexpected(&row.image)),
    };
    let Row { method, bpw, seed, round, image, .. } = row.clone();
    Ok(MergedImage { method, budget: bpw, seed, round, address: image, made: figures })
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
