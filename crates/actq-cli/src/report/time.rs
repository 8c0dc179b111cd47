//! The predicted time of a step.

use actq::measure::time::StepTime;
use actq_kernels::Image;

use super::table::table;

/// Formats the table that `actq inspect` prints, if the model has the image's layouts.
pub fn report(image: &Image<'_>, step: &StepTime) -> String {
    if !is_modelled(image) {
        return NOT_MODELLED.to_owned();
    }
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
pub const NOT_MODELLED: &str = "No time is predicted: the weights are in other layouts than those of the Cortex-M4.\n";

/// Returns `true` if the model of the Cortex-M4 has the image's layouts.
pub fn is_modelled(image: &Image<'_>) -> bool {
    image.features().all(|feature| !["scalar", "helium"].contains(&feature))
}

/// Formats the time of the step as a sentence.
pub fn sentence(step: &StepTime) -> String {
    format!("Predicted time of a step: {:.3} ms {}.\n", step.milliseconds, conditions(step.clock_hz))
}

/// Formats the conditions of all predicted times.
pub fn conditions(clock_hz: f64) -> String {
    format!("at {} MHz on a Cortex-M4 with FPU and zero-wait-state memory", clock_hz / 1e6)
}
