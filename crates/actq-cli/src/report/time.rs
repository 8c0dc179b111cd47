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
        _ => Ok(steps(image, &of_image(image, core, clock_hz)?)),
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

fn steps(image: &Image<'_>, step: &StepTime) -> String {
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
    format!(
        "{rows}\n\n{}The least slice budget of a poll is {} instructions.\n",
        sentence(image, step),
        step.least_budget
    )
}

/// Says why there is no time.
fn unknown(image: &Image<'_>) -> String {
    format!("The weights are in the layouts of {}: name one with --core for the time of a step.\n", cores(image))
}

/// Formats the time of the step as a sentence, and says what happens if it is longer than a control period.
pub fn sentence(image: &Image<'_>, step: &StepTime) -> String {
    let estimate = if step.core.is_modelled() { "" } else { " (an estimate)" };
    let conditions = conditions(step.core, step.clock_hz);
    let late = lateness(image, 1e-3 * step.milliseconds * f64::from(image.rate_hz())).unwrap_or_default();
    format!("Predicted time of a step: {:.3} ms {conditions}{estimate}.\n{late}", step.milliseconds)
}

/// Says what a step of `taken` control periods means, if it is more than one.
fn lateness(image: &Image<'_>, taken: f64) -> Option<String> {
    if taken <= 1.0 {
        return None;
    }
    let (late, most, period) = (taken.ceil(), periods(image), 1e3 / image.rate_hz());
    let times = format!("It takes {taken:.1} control periods of {period:.1} ms");
    if late <= most as f64 {
        return Some(format!(
            "{times}, in which the rest of the chunk before plays; `actq serve --late {late}` drives the image so.\n"
        ));
    }
    let is_dropped = !image.keeps_rest() && image.execute() < image.chunk();
    let overlap =
        if is_dropped { ", or an overlap, so that the rest of a chunk plays meanwhile (docs/POLICY.md)" } else { "" };
    Some(format!(
        "{times}, and with more than {most} some periods have no action: take a faster processor, fewer bits, a lower \
         rate{overlap}.\n"
    ))
}

/// Returns the control periods that a run of the network may take so that an action plays in each. Only an overlap or an
/// ensemble keeps the rest of a chunk while the next one is computed; and a chunk that is `late` periods late begins with
/// position `late`, in the period before the next run.
pub(super) fn periods(image: &Image<'_>) -> usize {
    let kept = if image.horizon() > 0 { image.horizon() } else { image.chunk() };
    let kept = kept.min(image.deadline().unwrap_or(usize::MAX));
    let late = kept.saturating_sub(image.execute()).min(kept.saturating_sub(1) / 2);
    if image.keeps_rest() { late.max(1) } else { 1 }
}

/// Formats the conditions of all predicted times.
pub fn conditions(core: Core, clock_hz: f64) -> String {
    format!("at {} MHz on {}, with zero-wait-state memory", clock_hz / 1e6, core.title())
}
