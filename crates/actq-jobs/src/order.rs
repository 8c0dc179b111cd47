//! The order of a plan's jobs, and plans as text.

use std::collections::BTreeMap;

use actq::error::{Context as _, Error, Result, bail, ensure};

use crate::job::Job;

/// Reads a plan: one job a line, as `actq plan` prints.
///
/// # Errors
///
/// Names the line of a job that cannot be read; refuses what [`check`] refuses.
pub fn read(text: &str) -> Result<Vec<Job>> {
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let job = |(number, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|error| Error::other(error).context(format!("line {}", number + 1)))
    };
    let jobs = lines.map(job).collect::<Result<Vec<Job>>>()?;
    check(&jobs)?;
    Ok(jobs)
}

/// Formats a plan: one job a line.
///
/// # Errors
///
/// If a job cannot be formatted, for example for a path that is not Unicode.
pub fn text(jobs: &[Job]) -> Result<String> {
    jobs.iter().map(|job| Ok(serde_json::to_string(job).context(job.title.clone())? + "\n")).collect()
}

/// Refuses two jobs of one address, and a dependency that is not in the plan. Jobs that were read have no cycle: an
/// address is a digest of the addresses that its job needs.
///
/// # Errors
///
/// Names the jobs.
pub fn check(jobs: &[Job]) -> Result<()> {
    ensure!(!jobs.is_empty(), "the plan has no job");
    let mut known: BTreeMap<&str, &Job> = BTreeMap::new();
    for job in jobs {
        if let Some(other) = known.insert(&job.address, job) {
            bail!(
                "jobs {:?} and {:?} have one address, {}: they would do the same work; remove one of them from the spec",
                other.title,
                job.title,
                job.address
            );
        }
    }
    for job in jobs {
        if let Some(dep) = job.deps.iter().find(|dep| !known.contains_key(dep.as_str())) {
            bail!("job {:?} needs job {dep}, which is not in the plan", job.title);
        }
    }
    Ok(())
}
