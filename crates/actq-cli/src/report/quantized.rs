//! The report of `actq quantize`.

use actq::measure::eval::ErrorReport;
use actq::methods::distill::balance::balance_bytes;
use actq::methods::{Choice, Imagined, Learning, Sampled};
use actq::pipeline::{QuantizedPolicy, Search, Try};
use actq::text::count;
use comfy_table::Table;

use super::table::{group_name, table};
use super::widths;

/// Formats a row for every matrix, and the sum of their bytes.
pub fn matrices(quantized: &QuantizedPolicy) -> String {
    let QuantizedPolicy { policy, outcomes, .. } = quantized;
    let has_errors = outcomes.iter().any(|outcome| outcome.error.is_some());
    let columns = ["matrix", "shape", "bits", "group", "bytes", "x max", "error"];
    let mut rows = table(&columns[..columns.len() - usize::from(!has_errors)]);
    let mut total = 0;
    for (matrix, outcome) in policy.graph.matrices.iter().zip(outcomes) {
        let quantized = &outcome.quantized;
        let bytes = outcome.bytes();
        total += bytes;
        let mut cells = vec![
            matrix.name.clone(),
            format!("{}x{}", matrix.rows, matrix.cols),
            quantized.width_counts(),
            group_name(quantized.group),
            bytes.to_string(),
            outcome.x_max.to_string(),
        ];
        cells.extend(has_errors.then(|| outcome.error.map_or("-".to_owned(), |e| format!("{e:.2e}"))));
        rows.add_row(cells);
    }
    let added = balance_bytes(&policy.graph);
    let with = if added > 0 { format!(" and {added} of balance factors") } else { String::new() };
    let bits = 8.0 * (total + added) as f64 / policy.weights.max(1) as f64;
    let by_row = outcomes.iter().any(|outcome| outcome.allocation.is_some());
    let widths = if by_row { widths::line(policy, outcomes) + "\n" } else { String::new() };
    format!("{rows}\n\n{total} bytes of weights with their scales{with}, {bits:.3} bits per weight\n{widths}")
}

/// Formats the sample sizes of the statistics of a flow or diffusion policy.
pub fn sampled(Sampled { frames, inputs, outputs }: Sampled) -> String {
    let derived = if outputs > 0 { format!(", derivatives at {outputs} random ones") } else { String::new() };
    format!("statistics of {inputs} of {}{derived}, in every denoising step\n", count(frames, "frame"))
}

/// Formats how far a linear model of the robot can predict, and what was learned from its rollouts.
pub fn imagined(imagined: &Imagined) -> String {
    let predicted = format!("predicts {:.0}% of the next observation", 100.0 * imagined.predicted.max(0.0));
    match imagined.frames() {
        0 => format!(
            "learned from the recording only: a linear model of the robot, fitted to it, {predicted}, too little to imagine others\n"
        ),
        frames => format!(
            "learned also from {} that a linear model of the robot, fitted to the recording, imagined; it {predicted}\n",
            count(frames, "observation")
        ),
    }
}

/// Formats how long learning took, and among how many settings it chose.
pub fn learning(learning: &Learning) -> String {
    let Learning { steps, discarded, choice, tried } = learning;
    match choice {
        Choice::Feedback { .. } if *discarded > 0 => format!(
            "learned in {}, and discarded the result: its error is higher than without learning\n",
            count(*discarded, "step")
        ),
        Choice::Learning(_) if tried.is_empty() => {
            format!("learned the weights in {}\n", count(*steps, "step"))
        }
        Choice::Learning(_) => {
            let settings = count(tried.len(), "setting");
            format!("learned the weights in {}, with the best of {settings} of the learning\n", count(*steps, "step"))
        }
        Choice::Feedback { .. } => "not learned: weights are rounded with error feedback\n".to_owned(),
    }
}

/// Formats the tries of the search for `--max-nmse`, and the result.
pub fn search(search: &Search) -> String {
    let Search { limit, nmse, budget, step, fails, measured_on: file, .. } = search;
    let cells = ((budget - fails) / step).round();
    let below = if cells <= 1.0 && *fails > 0.0 {
        format!("{fails:.1} is too few")
    } else if *fails > 0.0 {
        format!("{fails:.1} is too few; values between were not tried")
    } else if cells <= 1.0 {
        "this is the least budget".to_owned()
    } else {
        "smaller budgets were not tried".to_owned()
    };
    let on = match search.held_out {
        true => file.clone(),
        false => format!("{file}, as there is no held-out recording; the error on new observations may be larger"),
    };
    format!(
        "{}\n\n{budget:.1} bits per weight keep the error within {limit}: NMSE {nmse:.2e}; {below}.\nMeasured on {on}.\n",
        tries(&search.tries)
    )
}

/// Formats a row for each try. Times are at the default clock.
fn tries(tries: &[Try]) -> Table {
    let mut table = table(&["bytes", "ms", "NMSE", "bits (limit)", "steps"]);
    for t in tries {
        let cell = |text: &dyn Fn(&ErrorReport) -> String| t.report.as_ref().map_or("-".to_owned(), text);
        table.add_row([
            cell(&|r| r.bytes.to_string()),
            t.milliseconds.map_or("-".to_owned(), |ms| format!("{ms:.3}")),
            cell(&|r| format!("{:.2e}", r.nmse)),
            format!("{} ({:.1})", cell(&|r| format!("{:.3}", r.bpw)), t.budget),
            t.steps.to_string(),
        ]);
    }
    table
}
