//! Records the expert's demonstrations for `train.py`.

use std::env;
use std::fs::File;

use actq::data::NpzWriter;
use actq::random::Random;
use actq_balancer::{RAW_LEN, TORQUE_LIMIT, Task, expert};
use anyhow::{Context as _, Result};

const EPISODES: usize = 400;
/// First seed, above those of every other use.
const FIRST_SEED: u64 = 100_000;
/// Largest standard deviation of the noise on applied torques, and the share that persists to the next step: slow noise
/// reaches states off the expert's path, from which its torques show the way back.
const NOISE: f64 = 0.15;
const MEMORY: f64 = 0.9;

/// Writes `raw [step, 11]`, `applied [step, 2]` (torques), `torque [step, 2]` (the expert's) and `first [step, 1]` (1
/// where an episode begins) to the file that the argument names.
fn main() -> Result<()> {
    let path = env::args().nth(1).context("usage: balancer-record FILE.npz")?;
    let (mut raw, mut applied, mut torque, mut first) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for seed in (FIRST_SEED..).take(EPISODES) {
        let (mut task, mut random) = (Task::new(seed), Random::new(!seed));
        let deviation = NOISE * f64::from(random.share());
        let mut noise = [0.0; 2];
        let begin = first.len();
        while !task.is_over() {
            let (state, command) = task.truth();
            let expert = expert::torques(state, command);
            let fresh = (1.0 - MEMORY * MEMORY).sqrt() * deviation;
            noise = noise.map(|x| MEMORY * x + fresh * f64::from(random.normal()));
            let torques = [0, 1].map(|i| (expert[i] + noise[i]).clamp(-TORQUE_LIMIT, TORQUE_LIMIT));
            first.push(if first.len() == begin { 1.0f32 } else { 0.0 });
            raw.extend(task.sense());
            applied.extend(torques.map(|x| x as f32));
            torque.extend(expert.map(|x| x as f32));
            task.apply(torques);
        }
    }
    let steps = first.len();
    let mut npz = NpzWriter::new(File::create(&path).with_context(|| path.clone())?);
    for (name, len, values) in
        [("raw", RAW_LEN, raw), ("applied", 2, applied), ("torque", 2, torque), ("first", 1, first)]
    {
        npz.array(name, &[steps, len], values)?;
    }
    npz.finish()?;
    println!("{path}: {steps} steps");
    Ok(())
}
