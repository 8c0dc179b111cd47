//! Closed loop of a policy behind a pipe, as `actq tune --drive` runs it.

use actq_ur3::pipe::PolicyPipe;
use actq_ur3::summary::summary;
use actq_ur3::task::{Outcome, Task};
use anyhow::{Result, ensure};
use clap::Parser;

/// Seeds reserved for driving: above those of calib.npz (0 on), heldout.npz (500 on) and evaluation (1000 on), below
/// those of demonstrations.
const DRIVING_SEEDS: std::ops::Range<u64> = 10_000..100_000;
/// Seeds per round, so that every round drives episodes of its own.
const SEEDS_OF_A_ROUND: u64 = 500;

/// Runs episodes with the command in POLICY_CMD as the policy, over its standard input and output, and prints one JSON
/// object: episodes, success (their share), ci (its 95% interval), errors over the hold phases.
#[derive(Parser)]
struct Options {
    /// The policy's command, as a shell reads it.
    #[arg(long, env = "POLICY_CMD")]
    policy: String,
    /// Number of episodes.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u64).range(1..=SEEDS_OF_A_ROUND))]
    episodes: u64,
    /// Seed of the first episode of round 0; round R begins 500 R above.
    #[arg(long, default_value_t = DRIVING_SEEDS.start)]
    seed: u64,
    /// The round, which moves the seeds.
    #[arg(long, env = "ACTQ_ROUND", default_value_t = 0)]
    round: u64,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let first = options.seed.saturating_add(options.round.saturating_mul(SEEDS_OF_A_ROUND));
    let seeds = first..first.saturating_add(options.episodes);
    ensure!(
        DRIVING_SEEDS.start <= seeds.start && seeds.end <= DRIVING_SEEDS.end,
        "seeds {seeds:?}: driving has those from {} to {}; others are kept for evaluation and training",
        DRIVING_SEEDS.start,
        DRIVING_SEEDS.end - 1
    );
    let mut policy = PolicyPipe::start(&options.policy)?;
    let outcomes = seeds.map(|seed| episode(seed, &mut policy)).collect::<Result<Vec<Outcome>>>()?;
    policy.finish()?;

    println!("{}", summary(&outcomes));
    Ok(())
}

fn episode(seed: u64, policy: &mut PolicyPipe) -> Result<Outcome> {
    policy.reset()?;
    let mut task = Task::new(seed);
    while !task.is_over() {
        task.step(&policy.act(&task.observe())?);
    }
    Ok(task.result())
}
