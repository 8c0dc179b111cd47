//! The balancing robot of `cargo demo`: a deploy bundle in closed loop, from raw sensor values to torques; of `cargo demo
//! --transformer`, one with attention.

use std::fs;
use std::path::{Path, PathBuf};

use actq::budget::Budget;
use actq::data::{Dataset, Recordings};
use actq::methods::{Effort, Method, Options};
use actq::pipeline;
use actq::runtime::{ImageBuffer, with_head};
use actq_balancer::{EPISODE_STEPS, Outcome, RAW_LEN, run_episode};
use actq_bench::qemu::Counter;
use actq_bench::{Target, evaluation, firmware};
use actq_cli::outputs::files;
use actq_deploy::description::Description;
use actq_deploy::{Bundle, DESCRIPTION, Deployment, Plan, Runner, observed};
use anyhow::{Context as _, Result};
use ndarray::Array3;

use crate::trials::{Column, Firmware, closed_loop, folder, mean, share, summary};

/// Rows of the table after those of the sizes.
const ROWS: [&str; 3] = ["closed-loop success", "speed error", "instructions per step"];
/// Budgets in bits per weight.
const BITS: [f64; 2] = [3.0, 2.0];
/// Episodes of the f32 policy to learn from, from seed 0.
const RECORDED_EPISODES: usize = 40;

/// Reads the bundle and writes its images; returns the raw values of the episodes that they learned from.
pub(crate) fn quantize(bundle: &Path) -> Result<Dataset> {
    fs::create_dir_all(folder())?;
    let policy = Deployment::load(bundle)?.policy;
    let bytes = 4 * policy.parameters;
    println!("\nReading the bundle {} ({} parameters, {bytes} bytes in f32)", policy.name, policy.parameters);
    println!("Recording {RECORDED_EPISODES} episodes of the f32 policy to learn from");
    let (raw, recordings) = recordings(bundle)?;
    for bits in BITS {
        println!("Quantizing to {} with distill", name(bits));
        let options = Options { effort: Effort::Quick, ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
        let image = pipeline::quantize(&policy, &recordings, &options, ())?.whole_image()?;
        files::write(&path(&policy.name, bits), &image)?;
    }
    Ok(raw)
}

/// Records episodes of the f32 policy: raw values, and the networks' observations in them.
pub(crate) fn recordings(bundle: &Path) -> Result<(Dataset, Recordings)> {
    let raw = F32::open(bundle)?.record()?;
    let calib = Some(observed(bundle, &raw)?);
    Ok((raw, Recordings { calib, heldout: None }))
}

/// Drives the robot with the bundle in f32 and with the images of [`quantize`], on the host and in QEMU; returns a
/// report.
pub(crate) fn drive(
    bundle: &Path,
    counter: &Counter,
    raw: &Dataset,
    episodes: u64,
    qemu_episodes: u64,
) -> Result<String> {
    let policy = Deployment::load(bundle)?.policy;
    let f32_bytes = 4 * policy.parameters;
    println!("\n{}: closed loop in f32, {episodes} episodes", policy.name);
    let mut f32_policy = F32::open(bundle)?;
    let outcomes = closed_loop(episodes, |seed| f32_policy.episode(seed, |_| ()))?;
    let mut columns = vec![Column::of_f32(f32_bytes, &[success(&outcomes), error(&outcomes)])];

    let mut report = Vec::new();
    for bits in BITS {
        let (name, path) = (name(bits), path(&policy.name, bits));
        let buffer = ImageBuffer::read(&path)?;
        let image = buffer.image(&path)?;
        println!("Closed loop at {name}, {episodes} episodes on the host");
        let outcomes = with_head(image, |head| {
            closed_loop(episodes, |seed| {
                head.reset();
                run_episode(seed, |raw| torques(head.step(raw)?))
            })
        })?;
        println!("Closed loop at {name}, {qemu_episodes} episodes with the firmware in QEMU as the policy");
        let elf = firmware::harness_with(Target::Fpu, &path)?;
        let firmware =
            Firmware::run(&elf, image, qemu_episodes, |seed, step| run_episode(seed, |raw| torques(&step(raw)?)))?;
        let instructions = evaluation::count(counter, Target::Fpu, &elf, None, &image, raw.episode(0))?.instructions;
        let figures = [success(&outcomes), error(&outcomes), instructions.to_string()];
        columns.push(Column::new(&name, &image, f32_bytes, &figures));
        report.push(firmware.report(&name, &success(&firmware.outcomes), &elf, image)?);
    }
    Ok(format!("{}\n\n{}\n", summary(&policy.name, &ROWS, &columns), report.join("\n")))
}

/// Returns the name of an image, and its file.
fn name(bits: f64) -> String {
    format!("{bits:.1} bits")
}

fn path(policy: &str, bits: f64) -> PathBuf {
    folder().join(format!("{policy}-{bits:.1}-bits.actq"))
}

/// The policy as its bundle describes it, in f32.
struct F32(Runner);

impl F32 {
    fn open(bundle: &Path) -> Result<Self> {
        let opened = Bundle::open(bundle)?;
        let description = Description::parse(&opened.text(DESCRIPTION)?)?;
        Ok(Self(Runner::new(Plan::new(&description, &opened)?)))
    }

    /// Runs an episode; `see` gets the raw values of each step.
    fn episode(&mut self, seed: u64, mut see: impl FnMut(&[f32])) -> Result<Outcome> {
        self.0.reset();
        run_episode(seed, |raw| {
            see(raw);
            let inputs = self.0.plan().split(raw);
            let tick = self.0.step(&inputs)?;
            let (_, torque) = tick.targets.first().context("the bundle has no target")?;
            torques(&torque.iter().map(|x| *x as f32).collect::<Vec<_>>())
        })
    }

    /// Records the raw values of some episodes.
    fn record(&mut self) -> Result<Dataset> {
        let mut obs = Array3::zeros((RECORDED_EPISODES, EPISODE_STEPS, RAW_LEN));
        let mut length = Vec::new();
        for seed in 0..RECORDED_EPISODES {
            let mut steps = 0;
            self.episode(seed as u64, |raw| {
                raw.iter().enumerate().for_each(|(i, value)| obs[[seed, steps, i]] = *value);
                steps += 1;
            })?;
            length.push(steps);
        }
        Ok(Dataset { path: "episodes of f32".into(), obs, action: None, length, state: None })
    }
}

fn torques(values: &[f32]) -> Result<[f32; 2]> {
    values.try_into().context("the policy must give two torques")
}

fn success(outcomes: &[Outcome]) -> String {
    share(outcomes, |outcome| outcome.success)
}

fn error(outcomes: &[Outcome]) -> String {
    format!("{:.1} mm/s", mean(outcomes, |outcome| outcome.speed_error))
}
