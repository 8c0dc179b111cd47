//! Jobs that run closed-loop episodes.

use actq::data::{Dataset, Sizes, joined};
use actq::error::{Result, ensure};
use actq::pipeline::driven::DriveOutcome;

use super::inputs::{self, Kept, path_of};
use crate::digest::of_bytes;
use crate::error::JobError;
use crate::figures::Driven;
use crate::host::{Host, Rollout};
use crate::job::Job;
use crate::record::Outcome;
use crate::store::Store;
use crate::work::{Drive, Episodes};

/// Runs the episodes of a job.
pub(super) fn drive(
    job: &Job,
    drive: &Drive,
    store: &Store,
    host: &dyn Host,
) -> Result<(Outcome, Option<Kept>), JobError> {
    let (_, buffer) = match inputs::image(&drive.image, store)? {
        Ok(image) => image,
        Err(why) => return Ok((Outcome::Impossible(why), None)),
    };
    let path = store.image(&drive.image);
    let image = buffer.image(&path)?;
    let Episodes { first, count } = drive.seeds;
    let rollout = Rollout {
        command: &drive.command,
        folder: drive.folder.as_deref(),
        policy: path_of(drive.policy.as_deref())?,
        image: &path,
        first,
        count,
        record: drive.record.then(|| Sizes::of_image(&image)),
    };
    let mut rolled = host.drive(&rollout)?;
    let kept = match drive.record {
        true => Some(npz(&mut rolled.recordings, Sizes::of_image(&image))?),
        false => None,
    };
    let mut driven = counts(rolled.outcome, count)?;
    driven.recording = kept.as_deref().map(of_bytes);
    let kept = kept.map(|bytes| Kept { path: store.recording(&job.address), bytes });
    Ok((Outcome::Driven(driven), kept))
}

/// Returns the counts that a command reported.
fn counts(outcome: Option<DriveOutcome>, count: u64) -> Result<Driven> {
    let outcome = outcome.unwrap_or_default();
    if let Some(episodes) = outcome.number("episodes") {
        ensure!(
            episodes == count as f64,
            "the drive command ran {episodes} episodes instead of {count}; it must run ACTQ_EPISODES episodes, from the seed ACTQ_SEED \
             on"
        );
    }
    let successes = match outcome.success() {
        Some(share) => {
            ensure!(
                (0.0..=1.0).contains(&share),
                "the drive command reported a success of {share}; it is a share, 0 to 1"
            );
            Some((share * count as f64).round() as u64)
        }
        None => None,
    };
    let other = outcome.keys().filter(|key| !matches!(*key, "episodes" | "success"));
    let numbers = other.filter_map(|key| Some((key.to_owned(), outcome.number(key)?))).collect();
    Ok(Driven { episodes: count, successes, numbers, recording: None })
}

/// Joins recordings to one file.
fn npz(parts: &mut [Dataset], sizes: Sizes) -> Result<Vec<u8>> {
    ensure!(!parts.is_empty(), "the drive command recorded nothing; it must run POLICY_CMD as its policy");
    // Policies that ran at the same time may have written their files in any order.
    parts.sort_by_cached_key(|part| part.obs.iter().map(|value| value.to_bits()).collect::<Vec<u32>>());
    joined(parts, sizes.state)?.npz(sizes)
}
