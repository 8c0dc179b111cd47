//! Records episodes as `.npz`: the expert's demonstrations for training, or with `--policy` the policy's own episodes
//! for quantization.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use actq::data::NpzWriter;
use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::random::Random;
use actq_ur3::task::{EPISODE_STEPS, Task};
use actq_ur3::{ACT_DIM, CHUNK, OBS_DIM};
use anyhow::{Context, Result, bail, ensure};
use clap::Parser;

/// Episodes of the policy in the shipped calib.npz. Seeds count from 0.
const SHIPPED_EPISODES: u32 = 12;
/// Default number of demonstrations.
const DEMONSTRATIONS: u32 = 5000;
/// Seeds of the policy's episodes in heldout.npz.
const HELDOUT_SEEDS: std::ops::Range<u64> = 500..508;
/// Demonstrations start from this seed, above those of every other use.
const FIRST_TRAINING_SEED: u64 = 100_000;

/// Largest standard deviation of the noise on executed actions, rad/s.
const ACTION_NOISE: f64 = 0.6;
/// Share of the noise that persists to the next control step: slow noise moves the arm further away.
const NOISE_MEMORY: f64 = 0.9;

/// Records demonstrations of the expert (demonstrations.npz), or with --policy calib.npz and heldout.npz.
#[derive(Parser)]
struct Options {
    /// Folder for the files; created if it does not exist.
    #[arg(long)]
    out: PathBuf,
    /// Number of demonstrations, or of the policy's episodes in calib.npz, at most 500 [default: 5000, of the policy
    /// 12].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=20_000))]
    episodes: Option<u32>,
    /// Seed of the first demonstration, from 100000 on.
    #[arg(long, default_value_t = FIRST_TRAINING_SEED)]
    seed: u64,
    /// Folder with policy.json and policy.safetensors: record this policy's episodes instead of demonstrations.
    #[arg(long, conflicts_with = "seed")]
    policy: Option<PathBuf>,
}

fn main() -> Result<()> {
    let options = Options::parse();
    fs::create_dir_all(&options.out).with_context(|| format!("create {}", options.out.display()))?;
    if let Some(dir) = &options.policy {
        let mut policy = PolicyF32::load(dir)?;
        let calib = 0..u64::from(options.episodes.unwrap_or(SHIPPED_EPISODES));
        ensure!(
            calib.end <= HELDOUT_SEEDS.start,
            "--episodes {} would take the seeds of the held-out episodes, from {} on",
            calib.end,
            HELDOUT_SEEDS.start
        );
        record_policy(&mut policy, calib, &options.out.join("calib.npz"))?;
        return record_policy(&mut policy, HELDOUT_SEEDS, &options.out.join("heldout.npz"));
    }
    let last = options.seed.checked_add(u64::from(options.episodes.unwrap_or(DEMONSTRATIONS)));
    match last {
        Some(last) if options.seed >= FIRST_TRAINING_SEED => {
            record_expert(options.seed..last, &options.out.join("demonstrations.npz"))
        }
        Some(_) => bail!("--seed {} is below {FIRST_TRAINING_SEED}, kept for evaluation", options.seed),
        None => bail!("--seed {} is too large", options.seed),
    }
}

/// Writes every visited state with the expert's next chunk from there: `obs [n, 18]`, `action [n, 8, 6]`.
fn record_expert(seeds: std::ops::Range<u64>, path: &Path) -> Result<()> {
    let mut obs = Vec::new();
    let mut action = Vec::new();
    for seed in seeds {
        let mut task = Task::new(seed);
        // Seeds of the noise must differ from those of the episodes.
        let mut random = Random::new(!seed);
        let deviation = random.range(0.0, ACTION_NOISE);
        let mut noise = [0.0; ACT_DIM];
        while !task.is_over() {
            let plan = task.expert_plan();
            obs.extend(task.observe());
            action.extend(plan.iter().flatten().map(|&x| x as f32));
            // The noise reaches states off the expert's path; the recorded plan shows the way back.
            let fresh = (1.0 - NOISE_MEMORY * NOISE_MEMORY).sqrt() * deviation;
            noise = noise.map(|x| NOISE_MEMORY * x + fresh * random.normal());
            task.step(&core::array::from_fn(|i| (plan[0][i] + noise[i]) as f32));
        }
    }
    let steps = obs.len() / OBS_DIM;
    let mut npz = create(path)?;
    npz.array("obs", &[steps, OBS_DIM], obs)?;
    npz.array("action", &[steps, CHUNK, ACT_DIM], action)?;
    npz.finish()?;
    println!("{}: {steps} steps", path.display());
    Ok(())
}

/// Writes closed-loop episodes of the policy: `obs [episode, step, 18]`, `action [episode, step, 48]` (the network's
/// output at every step, also where a queued action is played; not of a flow, whose output depends on noise),
/// `length [episode]`, `seed [episode]`.
fn record_policy(policy: &mut PolicyF32, seeds: std::ops::Range<u64>, path: &Path) -> Result<()> {
    let mut obs = Vec::new();
    let mut action = Vec::new();
    for seed in seeds.clone() {
        policy.reset();
        let mut task = Task::new(seed);
        while !task.is_over() {
            let observation = task.observe();
            obs.extend(observation);
            if !policy.draws() {
                action.extend(policy.raw(&observation));
            }
            task.step(&policy.act(&observation));
        }
    }
    let episodes = seeds.clone().count();
    let mut npz = create(path)?;
    npz.array("obs", &[episodes, EPISODE_STEPS, OBS_DIM], obs)?;
    if !policy.draws() {
        let outputs = action.len() / (episodes * EPISODE_STEPS);
        npz.array("action", &[episodes, EPISODE_STEPS, outputs], action)?;
    }
    npz.array("length", &[episodes], vec![EPISODE_STEPS as i64; episodes])?;
    npz.array("seed", &[episodes], seeds.map(|seed| seed as i64))?;
    npz.finish()?;
    println!("{}: {episodes} episodes", path.display());
    Ok(())
}

fn create(path: &Path) -> Result<NpzWriter<BufWriter<File>>> {
    let file = File::create(path).with_context(|| format!("create {}", path.display()))?;
    Ok(NpzWriter::new(BufWriter::new(file)))
}
