//! `cargo xtask faults`: drives the arm in closed loop through the controller's serial port, with faults on the line.

use std::path::Path;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::methods::{Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::uart::{Compared, Disturbance, Rig, Run};
use actq_bench::{Target, firmware, ur3};
use actq_cli::report::table::table;
use actq_kernels::Image;
use actq_ur3::task::EPISODE_STEPS;
use anyhow::{Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};

/// First seed of the episodes, none of which the policy was trained or recorded on, or `cargo demo` drives.
const FIRST_SEED: u64 = 3000;
/// Seed of the faults.
const SEED: u64 = 1;
/// Failed attempts at an episode before it counts as failed, each undisturbed by this machine; and disturbed attempts
/// before it is not judged.
const ATTEMPTS: usize = 5;
const DISTURBED_ATTEMPTS: usize = 3;

/// Runs all faults, with the UR3 policy in 3 bits, and an update to another image of it.
pub(crate) fn all() -> Result<()> {
    let policy = Policy::load(&ur3())?;
    let options = Options { steps: Some(0), ..Options::new(Method::Distill, Budget::BitsPerWeight(3.0)) };
    let new = ImageBuffer::new(&quantize(&policy, &Recordings::load(&policy)?, &options, ())?.image);
    let old = firmware::built_in()?;
    let buffer = ImageBuffer::read(old)?;
    run(Target::Fpu, old, &Disturbance::all(new.bytes()), &[buffer.image(old)?, new.image(Path::new("the new image"))?])
}

/// Runs two of them with this image, for a demonstration.
pub(crate) fn some(image: &Path) -> Result<()> {
    let buffer = ImageBuffer::read(image)?;
    let disturbances: Vec<_> = Disturbance::all(&[]).into_iter().filter(Disturbance::is_for_demo).collect();
    run(Target::Fpu, image, &disturbances, &[buffer.image(image)?])
}

/// Runs an episode for each of `disturbances` with the application for the target's board and its built-in `image`, and
/// prints the table of the results. `images` are the built-in one and those that updates bring.
pub(crate) fn run(target: Target, image: &Path, disturbances: &[Disturbance<'_>], images: &[Image<'_>]) -> Result<()> {
    println!(
        "\nClosed loop through the serial port of the controller ({} in QEMU), with faults on the line",
        target.board().name
    );
    let elf = firmware::controller_with(target, image)?;
    let mut rig = Rig::start(target, &elf, &images[0], SEED)?;
    let mut summary =
        table(&["fault", "of frames", "found", "safe after", "armed again", "actions", "goals", "tracking"]);
    let (mut failures, mut busy) = (Vec::new(), Vec::new());
    for (seed, disturbance) in (FIRST_SEED..).zip(disturbances) {
        let (run, verdict) = judged(&mut rig, seed, disturbance)?;
        match verdict {
            Verdict::Passed => {}
            Verdict::Failed(why) => failures.push(format!("{disturbance}: {why}")),
            Verdict::Disturbed => busy.push(disturbance.to_string()),
        }
        summary.add_row(row(disturbance, &run));
    }
    println!("\n{summary}\n");
    if !busy.is_empty() {
        println!(
            "not judged, because this machine is too busy to run host and board side by side: {}",
            busy.join(", ")
        );
    }
    let Compared { actions, foreign, unknown } = rig.log().compare(images)?;
    println!("{actions} actions of the controller, {foreign} of them differ in bits from the host executor's");
    if unknown > 0 {
        println!("not compared: {unknown}, after frames that the controller dropped because the host read too slowly");
    }
    ensure!(foreign == 0, "the controller sent {foreign} actions that its head does not compute");
    ensure!(failures.is_empty(), "{}", failures.join("\n"));
    Ok(())
}

/// The verdict of all attempts at an episode.
enum Verdict {
    Passed,
    Failed(anyhow::Error),
    /// None: this machine has delayed the host.
    Disturbed,
}

/// The last attempt at an episode, and the verdict of all.
fn judged(rig: &mut Rig, seed: u64, disturbance: &Disturbance<'_>) -> Result<(Run, Verdict)> {
    let (mut undisturbed, mut disturbed) = (0, 0);
    loop {
        let run = episode(rig, seed, disturbance)?;
        let Err(why) = run.check(disturbance) else { return Ok((run, Verdict::Passed)) };
        *(if run.disturbed { &mut disturbed } else { &mut undisturbed }) += 1;
        if undisturbed == ATTEMPTS {
            return Ok((run, Verdict::Failed(why)));
        }
        if disturbed == DISTURBED_ATTEMPTS {
            return Ok((run, Verdict::Disturbed));
        }
        let busy = if run.disturbed { ", while this machine delayed it" } else { "" };
        println!("  {disturbance}: {why}{busy}; trying again");
    }
}

/// Runs an episode, with a live line on a terminal.
fn episode(rig: &mut Rig, seed: u64, disturbance: &Disturbance<'_>) -> Result<Run> {
    let bar = ProgressBar::new(EPISODE_STEPS as u64).with_prefix(disturbance.to_string());
    bar.set_style(ProgressStyle::with_template("  {prefix:22} [{bar:30}] {msg}")?.progress_chars("=> "));
    let run = rig.run(seed, *disturbance, |progress| {
        bar.set_position(progress.steps as u64);
        let (millimetres, speed) = (1e3 * progress.distance, progress.fastest);
        bar.set_message(format!("{}, {millimetres:.0} mm to the goal, {speed:.1} rad/s", progress.state));
    });
    bar.finish_and_clear();
    run
}

fn row(disturbance: &Disturbance<'_>, run: &Run) -> Vec<String> {
    let dash = || "-".to_owned();
    let tally = run.tally;
    let met = tally.dropped + tally.delayed + tally.duplicated + tally.corrupted;
    let found = run.found.0 + run.found.1 + run.refused;
    let goals = match (run.outcome.success, run.reached) {
        (true, _) => "both",
        (false, true) => "the second",
        (false, false) => "missed",
    };
    vec![
        disturbance.to_string(),
        format!("{met} of {}", tally.sent),
        found.to_string(),
        run.reaction.map_or_else(dash, |reaction| format!("{} to {} ms", reaction.least, reaction.most)),
        run.again.map_or_else(dash, |ms| format!("{ms} ms")),
        format!("{} of {EPISODE_STEPS}", run.applied),
        goals.to_owned(),
        format!("{:.1} mm", 1e3 * run.outcome.tracking_error_m),
    ]
}
