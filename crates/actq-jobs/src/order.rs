//! The order of a plan's jobs, and plans as text.

use std::collections::{BTreeMap, BTreeSet};

use actq::error::{Context as _, Error, Result, bail, ensure};
use serde::Deserialize;

use crate::job::Job;

/// The parts of a job on which the order depends.
#[derive(Deserialize)]
struct Node {
    address: String,
    title: String,
    deps: Vec<String>,
}

/// Reads a plan: one job a line, as `actq plan` prints.
///
/// # Errors
///
/// Names the line of a job that cannot be read; refuses what [`check`] refuses.
pub fn read(text: &str) -> Result<Vec<Job>> {
    let lines = || text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let at =
        |number: usize| move |error: serde_json::Error| Error::other(error).context(format!("line {}", number + 1));
    let node = |(number, line): (usize, &str)| serde_json::from_str(line).map_err(at(number));
    check_nodes(&lines().map(node).collect::<Result<Vec<Node>>>()?)?;
    lines().map(|(number, line)| serde_json::from_str(line).map_err(at(number))).collect()
}

/// Formats a plan: one job a line.
///
/// # Errors
///
/// If a job cannot be formatted, for example for a path that is not Unicode.
pub fn text(jobs: &[Job]) -> Result<String> {
    jobs.iter().map(|job| Ok(serde_json::to_string(job).context(job.title.clone())? + "\n")).collect()
}

/// Refuses two jobs of one address, a dependency that is not in the plan, and cycles.
///
/// # Errors
///
/// Names the jobs.
pub fn check(jobs: &[Job]) -> Result<()> {
    let node = |job: &Job| Node { address: job.address.clone(), title: job.title.clone(), deps: job.deps.clone() };
    check_nodes(&jobs.iter().map(node).collect::<Vec<_>>())
}

fn check_nodes(nodes: &[Node]) -> Result<()> {
    ensure!(!nodes.is_empty(), "the plan has no job");
    let mut known: BTreeMap<&str, &Node> = BTreeMap::new();
    for node in nodes {
        if let Some(other) = known.insert(&node.address, node) {
            bail!(
                "jobs {:?} and {:?} have one address, {}: they would do the same work; remove one of them from the spec",
                other.title,
                node.title,
                node.address
            );
        }
    }
    for node in nodes {
        if let Some(dep) = node.deps.iter().find(|dep| !known.contains_key(dep.as_str())) {
            bail!("job {:?} needs job {dep}, which is not in the plan", node.title);
        }
    }
    // Take jobs without open dependencies until none is left.
    let mut open: Vec<&Node> = nodes.iter().collect();
    let mut done: BTreeSet<&str> = BTreeSet::new();
    while !open.is_empty() {
        let (ready, rest): (Vec<&Node>, Vec<&Node>) =
            open.iter().partition(|node| node.deps.iter().all(|dep| done.contains(dep.as_str())));
        let Some(first) = rest.first().filter(|_| ready.is_empty()) else {
            done.extend(ready.iter().map(|node| node.address.as_str()));
            open = rest;
            continue;
        };
        bail!("the dependencies of job {:?} form a cycle; plan again from the spec", first.title);
    }
    Ok(())
}
