//! Closed-loop success of the `f32` policy, or of the expert, over a range of episodes.

use std::path::PathBuf;

use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::task::{Outcome, run_episode, run_expert};
use anyhow::{Context, Result};
use clap::Parser;

/// Runs episodes and prints the number of successes.
#[derive(Parser)]
struct Options {
    /// Folder with policy.json and policy.safetensors; without it, the expert is run.
    #[arg(long)]
    policy: Option<PathBuf>,
    /// Number of episodes.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    episodes: u32,
    /// Seed of the first episode.
    #[arg(long, default_value_t = 1000)]
    seed: u64,
}

fn main() -> Result<()> {
    let options = Options::parse();
    let last = options.seed.checked_add(u64::from(options.episodes)).context("--seed is too large")?;
    let mut policy = options.policy.as_deref().map(PolicyF32::load).transpose()?;
    let outcomes: Vec<Outcome> = (options.seed..last)
        .map(|seed| match &mut policy {
            Some(policy) => {
                policy.reset();
                run_episode(seed, |obs| policy.act(obs))
            }
            None => run_expert(seed),
        })
        .collect();

    let successes = outcomes.iter().filter(|outcome| outcome.success).count();
    let mean = |part: fn(&Outcome) -> f64| outcomes.iter().map(part).sum::<f64>() / outcomes.len() as f64;
    println!("success {successes}/{}", outcomes.len());
    println!("final error {:.2} mm", 1e3 * mean(|outcome| outcome.final_error_m));
    println!("tracking error {:.2} mm", 1e3 * mean(|outcome| outcome.tracking_error_m));
    println!("axis error {:.2} mrad", 1e3 * mean(|outcome| outcome.axis_error_rad));
    Ok(())
}
