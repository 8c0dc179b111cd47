//! `cargo demo`: takes the UR3 policies from their PyTorch weights, and the balancer from its bundle, to a Cortex-M4,
//! in closed loop.

use std::fs;
use std::path::PathBuf;
use std::thread;

use actq::budget::Budget;
use actq::data::{Dataset, Recordings};
use actq::measure::eval;
use actq::methods::{Effort, Method, Options};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::closed_loop::{episode, episode_on_host};
use actq_bench::qemu::Counter;
use actq_bench::{Target, evaluation, firmware, ur3, ur3_flow};
use actq_kernels::Width;
use actq_ur3::OBS_DIM;
use actq_ur3::policy_f32::PolicyF32;
use actq_ur3::task::{EPISODE_STEPS, Outcome, run_episode};
use anyhow::{Context, Result};
use ndarray::Array3;

use crate::trials::{Column, Firmware, closed_loop, folder, mean, share, summary};
use crate::{balancer, faults, heads, kernels};

/// Distillation steps of the flow, whose step evaluates the network five times.
const FLOW_STEPS: usize = 100;
/// Divisor of the flow's episodes, and of the balancer's in QEMU, which have five times as many steps as the arm's.
const EPISODES_DIVISOR: u64 = 4;

/// Episodes of the f32 policy to learn from, from seed 0: the 12 of `calib.npz` cover only a narrow part of the
/// observations that the policy meets.
const RECORDED_EPISODES: usize = 100;

/// Records the observations of the f32 policy's episodes.
pub(crate) fn record(policy: &mut PolicyF32) -> Result<Dataset> {
    let mut obs = Vec::with_capacity(RECORDED_EPISODES * EPISODE_STEPS * OBS_DIM);
    for seed in 0..RECORDED_EPISODES as u64 {
        policy.reset();
        run_episode(seed, |observation| {
            obs.extend_from_slice(observation);
            policy.act(observation)
        });
    }
    Ok(Dataset {
        path: "episodes of f32".into(),
        obs: Array3::from_shape_vec((RECORDED_EPISODES, EPISODE_STEPS, OBS_DIM), obs)?,
        action: None,
        length: vec![EPISODE_STEPS; RECORDED_EPISODES],
        state: None,
    })
}

/// The image that the motor controller runs.
const CONTROLLER_IMAGE: &str = "3.0 bits";

/// The images of a policy, and how to try them.
struct Trial<'a> {
    /// Human-readable name.
    name: &'a str,
    dir: PathBuf,
    images: Vec<(&'a str, Options)>,
    /// Learns from episodes of the f32 policy instead of the folder's recording.
    recorded: bool,
    episodes: u64,
    qemu_episodes: u64,
}

/// Rows of the table after those of the sizes.
const ROWS: [&str; 5] =
    ["held-out NMSE", "closed-loop success", "tracking error", "instructions per evaluation", "instructions per MAC"];

pub(crate) fn run(episodes: u64, qemu_episodes: u64) -> Result<()> {
    let eight = Options::new(Method::Gptq, Budget::Width(Width::W8));
    let distill =
        |bits| Options { effort: Effort::Quick, ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
    let of_flow = |bits| Options { steps: Some(FLOW_STEPS), ..distill(bits) };
    let counter = Counter::build()?;
    // Learning gains little from a second thread of one core, so the firmware compiles beside it. With the images that
    // follow, little is left to build.
    thread::spawn(|| {
        // An error comes again where the firmware is needed.
        let _ = firmware::harness(Target::Fpu);
        let _ = firmware::controller(Target::Fpu, "");
        let _ = firmware::binary("bench", Target::Fpu);
    });
    let some = |episodes: u64| (episodes / EPISODES_DIVISOR).max(1);
    let reach = Trial {
        name: "UR3 reach",
        dir: ur3(),
        images: vec![("8 bits", eight), (CONTROLLER_IMAGE, distill(3.0)), ("2.0 bits", distill(2.0))],
        recorded: true,
        episodes,
        qemu_episodes,
    };
    let flow = Trial {
        name: "UR3 flow",
        dir: ur3_flow(),
        images: vec![("3.0 bits", of_flow(3.0)), ("2.0 bits", of_flow(2.0))],
        recorded: false,
        episodes: some(episodes),
        qemu_episodes: some(qemu_episodes),
    };
    reach.quantize()?;
    flow.quantize()?;
    let recording = balancer::quantize(actq_balancer::bundle())?;
    let reports = [
        reach.drive(&counter)?,
        flow.drive(&counter)?,
        balancer::drive(actq_balancer::bundle(), &counter, &recording, episodes, some(qemu_episodes))?,
    ];
    println!("\n{}", reports.join("\n"));
    faults::some(&reach.path(CONTROLLER_IMAGE))?;
    println!();
    let records = kernels::measure(&counter, 0)?;
    println!(
        "Whole calls on the Cortex-M4, instructions counted, cycles modelled:\n\n{}",
        kernels::report(&records, Some((256, 256)))
    );
    Ok(())
}

/// Drives the balancer by its transformer alone.
pub(crate) fn transformer(episodes: u64, qemu_episodes: u64) -> Result<()> {
    let bundle = actq_balancer::transformer();
    let counter = Counter::build()?;
    let recording = balancer::quantize(bundle)?;
    println!("\n{}", balancer::drive(bundle, &counter, &recording, episodes, qemu_episodes)?);
    Ok(())
}

impl Trial<'_> {
    fn path(&self, image: &str) -> PathBuf {
        folder().join(format!("{} {image}.actq", self.name).to_lowercase().replace(' ', "-"))
    }

    /// Writes the images.
    fn quantize(&self) -> Result<()> {
        fs::create_dir_all(folder())?;
        let policy = Policy::load(&self.dir)?;
        println!(
            "\nQuantizing {} ({} parameters, {} bytes in f32)",
            policy.name,
            policy.parameters,
            f32_bytes(&policy)
        );
        let recordings = if self.recorded {
            println!("Recording {RECORDED_EPISODES} episodes of the f32 policy to learn from");
            Recordings { calib: Some(record(&mut PolicyF32::load(&self.dir)?)?), heldout: None }
        } else {
            Recordings::load(&policy)?
        };
        let mut prepared: Option<Quantizer<'_>> = None;
        for (name, options) in &self.images {
            println!("Quantizing to {name} with {}", options.method);
            // Images of one method share what does not depend on the budget.
            let reused = prepared.take().filter(|quantizer| quantizer.method().method() == &options.method);
            let new = || Quantizer::new(&policy, &recordings, options.method.clone(), None, |_| {});
            let quantizer = prepared.insert(reused.map_or_else(new, Ok)?);
            heads::write_image(quantizer, options, &self.path(name))?;
        }
        Ok(())
    }

    /// Drives the robot with the policy in f32 and with the images, on the host and in QEMU; returns a report.
    fn drive(&self, counter: &Counter) -> Result<String> {
        let &Self { name: policy_name, episodes, qemu_episodes, .. } = self;
        let policy = Policy::load(&self.dir)?;
        let f32_bytes = f32_bytes(&policy);
        println!("\n{policy_name}: closed loop in f32, {episodes} episodes");
        let mut reference = PolicyF32::load(&self.dir)?;
        let outcomes = closed_loop(episodes, |seed| {
            reference.reset();
            Ok(run_episode(seed, |obs| reference.act(obs)))
        })?;
        let mut columns = vec![Column::of_f32(f32_bytes, &["-".to_owned(), success(&outcomes), tracking(&outcomes)])];

        let mut report = Vec::new();
        for (name, _) in &self.images {
            let path = self.path(name);
            let buffer = ImageBuffer::read(&path)?;
            let image = buffer.image(&path)?;
            println!("Closed loop at {name}, {episodes} episodes on the host");
            let outcomes = with_head(image, |head| closed_loop(episodes, |seed| episode_on_host(head, seed)))?;
            println!("Closed loop at {name}, {qemu_episodes} episodes with the firmware in QEMU as the policy");
            let elf = firmware::harness_with(Target::Fpu, &path)?;
            let firmware = Firmware::run(&elf, image, qemu_episodes, |seed, step| {
                episode(seed, |obs| step(obs)?.as_slice().try_into().context("an action must have six values"))
            })?;
            let heldout = eval::heldout(&self.dir, &image)?;
            let instructions =
                evaluation::count(counter, Target::Fpu, &elf, None, &image, heldout.episode(0))?.instructions;
            let nmse = eval::evaluate(image, &heldout)?.nmse;
            let figures = [
                format!("{nmse:.1e}"),
                success(&outcomes),
                tracking(&outcomes),
                instructions.to_string(),
                match policy.graph.denoising {
                    None => format!("{:.2}", instructions as f64 / policy.graph.weights() as f64),
                    // A weight is multiplied once in each step.
                    Some(_) => "-".to_owned(),
                },
            ];
            columns.push(Column::new(name, &image, f32_bytes, &figures));
            report.push(firmware.report(name, &success(&firmware.outcomes), &elf, image)?);
        }

        Ok(format!("{}\n\n{}\n", summary(policy_name, &ROWS, &columns), report.join("\n")))
    }
}

fn f32_bytes(policy: &Policy) -> usize {
    4 * policy.parameters
}

fn success(outcomes: &[Outcome]) -> String {
    share(outcomes, |outcome| outcome.success)
}

fn tracking(outcomes: &[Outcome]) -> String {
    format!("{:.2} mm", mean(outcomes, |outcome| outcome.tracking_error_m))
}
