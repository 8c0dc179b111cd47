//! Closed loop of a policy behind a pipe, as `actq tune --drive` runs it.

use actq_ur3::pipe::PolicyPipe;
use actq_ur3::task::{Outcome, Task};
use anyhow::{Result, ensure};
use clap::Parser;
use serde_json::json;

/// Seeds kept for driving: above those of calib.npz (0 on), heldout.npz (500 on) and evaluation (1000 on), below those of
/// demonstrations.
const DRIVING_SEEDS: std::ops::Range<u64> = 10_000..100_000;
/// From one round to the next, so that every round drives episodes of its own.
const SEEDS_OF_A_ROUND: u64 = 500;

/// Runs episodes with the command in POLICY_CMD as the policy, over its standard input and output, and prints one JSON object:
/// episodes, success (their share), ci (its 95% interval), errors over the hold phases.
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

    let successes = outcomes.iter().filter(|outcome| outcome.success).count();
    let mean = |part: fn(&Outcome) -> f64| outcomes.iter().map(part).sum::<f64>() / outcomes.len() as f64;
    let report = json!({
        "episodes": outcomes.len(),
        "success": successes as f64 / outcomes.len() as f64,
        "ci": wilson(successes as f64, outcomes.len() as f64),
        "final_error_mm": 1e3 * mean(|outcome| outcome.final_error_m),
        "tracking_error_mm": 1e3 * mean(|outcome| outcome.tracking_error_m),
        "axis_error_mrad": 1e3 * mean(|outcome| outcome.axis_error_rad),
    });
    println!("{report}");
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

/// The 95% interval of a share (Wilson: Probable inference, the law of succession, and statistical inference, 1927).
fn wilson(successes: f64, trials: f64) -> [f64; 2] {
    /// Quantile of the normal distribution.
    const Z: f64 = 1.96;
    let (share, z2) = (successes / trials, Z * Z / trials);
    let middle = share + z2 / 2.0;
    let reach = Z * (share * (1.0 - share) / trials + z2 / (4.0 * trials)).sqrt();
    [-reach, reach].map(|side| ((middle + side) / (1.0 + z2)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_matches_worked_examples() {
        let near = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near(wilson(10.0, 10.0), [0.722, 1.0]));
        assert!(near(wilson(50.0, 100.0), [0.404, 0.596]));
        assert!(near(wilson(0.0, 20.0), [0.0, 0.161]));
    }
}
