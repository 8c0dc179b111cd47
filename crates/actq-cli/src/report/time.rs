//! The predicted time of a step.

use actq::emit::Core;
use actq::measure::time::StepTime;
use actq_kernels::Image;
use anyhow::{Result, ensure};

use super::table::table;

/// Formats the table that `actq inspect` prints for a core; without one for a Cortex-M4 with FPU, if the image has its
/// layouts.
///
/// # Errors
///
/// If the image has the layouts of other cores.
pub fn report(image: &Image<'_>, core: Option<Core>, clock_hz: f64) -> Result<String> {
    match core {
        None if !Core::M4f.has_layouts_of(image) => Ok(unknown(image)),
        _ => Ok(steps(&of_image(image, core, clock_hz)?)),
    }
}

/// Predicts the step of an image on a core; without one on a Cortex-M4 with FPU.
///
/// # Errors
///
/// If the image has the layouts of other cores.
pub fn of_image(image: &Image<'_>, core: Option<Core>, clock_hz: f64) -> Result<StepTime> {
    let core = core.unwrap_or(Core::M4f);
    ensure!(
        core.has_layouts_of(image),
        "the image has the layouts of {}, and no time is known for {}; `actq repack --core {}` converts it",
        cores(image),
        core.title(),
        core.name()
    );
    Ok(StepTime::new(image, core, clock_hz))
}

/// Returns the names of the cores whose layouts the image has.
fn cores(image: &Image<'_>) -> String {
    Core::of_image(image).map(Core::name).collect::<Vec<_>>().join(", ")
}

fn steps(step: &StepTime) -> String {
    let mut rows = table(&["op", "output", "runs", "MACs", "instructions", "per MAC", "cycles", "per MAC", "us"]);
    let mut row = |op: &str, output: String, runs: String, macs: usize, instructions: u64, cycles: u64, us: f64| {
        let per_mac = |n: u64| if macs == 0 { "-".to_owned() } else { format!("{:.3}", n as f64 / macs as f64) };
        let count = if macs == 0 { "-".to_owned() } else { macs.to_string() };
        rows.add_row([
            op.to_owned(),
            output,
            runs,
            count,
            instructions.to_string(),
            per_mac(instructions),
            cycles.to_string(),
            per_mac(cycles),
            format!("{us:.1}"),
        ]);
    };
    for op in &step.ops {
        row(&op.op, op.output.to_string(), op.runs.to_string(), op.macs, op.instructions, op.cycles, op.microseconds);
    }
    row("all", String::new(), String::new(), step.macs, step.instructions, step.cycles, 1e3 * step.milliseconds);
    format!("{rows}\n\n{}The least slice budget of a poll is {} instructions.\n", sentence(step), step.least_budget)
}

/// Says why there is no time.
fn unknown(image: &Image<'_>) -> String {
    format!("The weights are in the layouts of {}: name one with --core for the time of a step.\n", cores(image))
}

/// Formats the time of the step as a sentence.
pub fn sentence(step: &StepTime) -> String {
    let estimate = if step.core.is_modelled() { "" } else { " (an estimate)" };
    let conditions = conditions(step.core, step.clock_hz);
    format!("Predicted time of a step: {:.3} ms {conditions}{estimate}.\n", step.milliseconds)
}

/// Formats the conditions of all predicted times.
pub fn conditions(core: Core, clock_hz: f64) -> String {
    format!("at {} MHz on {}, with zero-wait-state memory", clock_hz / 1e6, core.title())
}
