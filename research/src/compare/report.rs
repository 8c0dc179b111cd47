//! The human-readable results.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use actq::emit::Core;
use actq::measure::time::CLOCK;
use actq::pipeline::driven::DriveOutcome;
use actq_cli::outputs::files;
use actq_cli::report::time::conditions;
use anyhow::Result;
use serde::Deserialize as _;
use serde_json::Value;

use super::cell::{Cell, CellKey, Made};
use super::least;
use super::limits::Limit;
use super::plan::Contender;
use super::results::{Header, Results};

/// Distance of the robot from its target, by the simulator's name for it, with its unit.
const TRACKING: [(&str, &str); 3] = [("tracking_error_mm", "mm"), ("err_lin", "m/s"), ("dist", "m")];

const READING: &str = "\
Bytes are those of the whole image in flash. ms, CMSIS-NN: the same step with products by that library's int8 kernel, 1.875 cycles \
a MAC and 50 a row, an estimate in its favour. NMSE is the error on the held-out recording, mean over the outputs. Success is that of the closed loop in percent of \
the episodes (95% interval, Wilson); every row of a policy is driven over the same seeds. Bits are per weight, with scales, steps and padding, \
and in parentheses the most that were allowed; rows with the same limit follow each other. `-`: no kernel, other codes, or not driven. Below \
each table is what was not made, and why.";

const STARRED: &str = "\
`*`: the method's default group does not fit the budget; of those that do, the one with the lowest held-out error was taken, which is \
in the method's favour.";

const K_QUANTS: &str = "\
actquant, K-quants: ActQuant in the block formats of its paper (llama.cpp's IQ2_XS, Q2_K, Q3_K, Q4_K and Q6_K at 2.3125, 2.625, 3.4375, 4.5 \
and 6.5625 bits per weight), a format a matrix by its scores and allocation, alpha 1 in its loss if nothing else is said. Simulated in f32, \
in its favour: activations are not rounded, padding of rows to 256 is not counted, and of its importance with and without llama.cpp's factor \
of the weights' magnitude, and of allocations from Q2_K and from IQ2_XS, the one with the lowest held-out error was taken. Its IQ2_XS has a \
grid of the same size and rate, but not llama.cpp's. Its image bytes are those of its blocks and everything else in f32.";

const RIVALS: &str = "\
student: a narrower network of the policy's structure, learned from random weights on, from the same recordings and the f32 policy's answers; pruned: \
the elements of hidden vectors with the largest Taylor importance, which learn on. The last column but one has their widths. The step of a student in f32 \
is an estimate of its products alone, 3 cycles each; it is not driven.";

/// Writes the report beside the results, and returns its path.
pub(super) fn write(results: &Results, folder: &Path) -> Result<PathBuf> {
    let asked = Asked::of(&results.header)?;
    let path = folder.join("compare.md");
    files::write(&path, markdown(results, &asked)?.as_bytes())?;
    Ok(path)
}

/// The plan's request: policies and methods in its order, budgets from few bits to many, independent of the order of
/// the runs.
struct Asked {
    policies: Vec<String>,
    methods: Vec<Contender>,
    budgets: Vec<Limit>,
}

impl Asked {
    fn of(header: &Header) -> Result<Self> {
        let read = |key: &str| header.options[key].clone();
        let mut budgets: Vec<Limit> = serde_json::from_value(read("budgets"))?;
        budgets.sort_by(Limit::order);
        Ok(Self {
            policies: serde_json::from_value(read("policies"))?,
            methods: serde_json::from_value(read("methods"))?,
            budgets,
        })
    }
}

fn markdown(results: &Results, asked: &Asked) -> Result<String> {
    let mut text = head(&results.header)?;
    if asked.methods.iter().any(|method| method.is_simulated()) {
        writeln!(text, "\n{K_QUANTS}")?;
    }
    if asked.methods.iter().any(|method| method.rival().is_some()) {
        writeln!(text, "\n{RIVALS}")?;
    }
    for policy in &asked.policies {
        section(&mut text, results, asked, policy)?;
    }
    Ok(text)
}

/// Writes date, sources, command and seeds.
fn head(header: &Header) -> Result<String> {
    let Header { commits, date, options, .. } = header;
    let mut text = String::new();
    writeln!(text, "# Comparison of the methods, {}\n", date.split(' ').next().unwrap_or(date))?;
    writeln!(text, "- begun {date} UTC, commit {}", commits.join(", then "))?;
    writeln!(text, "- `{}`", command(options))?;
    let (seed0, episodes) = (options["seed0"].as_u64().unwrap_or_default(), options["episodes"].as_u64().unwrap_or(1));
    writeln!(
        text,
        "- {episodes} episodes with the seeds {seed0} to {}, seed {} of the quantizer\n\n{READING}\n\nms: predicted time of a step, {}.",
        seed0 + episodes.saturating_sub(1),
        options["seed"],
        conditions(Core::M4f, CLOCK)
    )?;
    Ok(text)
}

/// Returns the command of these results.
fn command(options: &Value) -> String {
    let list = |value: &Value| -> String {
        let budget = |value: &Value| Limit::deserialize(value).ok().filter(|_| value.is_object());
        let plain = |value: &Value| match budget(value) {
            Some(allowed) => allowed.to_string(),
            None => value.as_str().map_or_else(|| value.to_string(), str::to_owned),
        };
        value.as_array().map_or_else(|| plain(value), |items| items.iter().map(plain).collect::<Vec<_>>().join(","))
    };
    let mut words = vec!["cargo xtask compare".to_owned()];
    for key in ["policies", "methods", "budgets", "episodes", "seed0", "seed", "steps"] {
        if !options[key].is_null() {
            words.push(format!("--{key} {}", list(&options[key])));
        }
    }
    words.join(" ")
}

fn section(text: &mut String, results: &Results, asked: &Asked, policy: &str) -> Result<()> {
    let find = |method: Option<Contender>, budget: Option<Limit>| {
        results.find(&CellKey { policy: policy.to_owned(), method, budget })
    };
    let f32_cell = find(None, None);
    let cells: Vec<(Contender, Limit, Option<&Cell>)> = asked
        .budgets
        .iter()
        .flat_map(|&budget| asked.methods.iter().map(move |&method| (method, budget)))
        .map(|(method, budget)| (method, budget, find(Some(method), Some(budget))))
        .collect();
    writeln!(text, "\n## {policy}\n")?;
    if f32_cell.is_none() && cells.iter().all(|(.., cell)| cell.is_none()) {
        writeln!(text, "No results.")?;
        return Ok(());
    }

    let unit = unit(f32_cell.into_iter().chain(cells.iter().filter_map(|(.., cell)| *cell)));
    let tracking = unit.map_or_else(|| "tracking error".to_owned(), |(_, unit)| format!("tracking error, {unit}"));
    let columns = [
        "bytes",
        "ms",
        "ms, CMSIS-NN",
        "NMSE",
        "success",
        &tracking,
        "bits (limit)",
        "bytes per parameter",
        "scale per",
        "seconds",
    ];
    header_row(text, "method", &columns.map(str::to_owned))?;
    let none = || "-".to_owned();
    let milliseconds = |of: Option<f64>| of.map_or_else(none, |ms| format!("{ms:.3}"));
    let success_of = |cell: &Cell| driven(cell).unwrap_or_else(none);
    let error_of = |cell: &Cell| {
        let error = unit.and_then(|(key, _)| cell.outcome()?.number(key));
        error.map_or_else(none, |error| format!("{error:.3}"))
    };
    let made = || cells.iter().filter_map(|(.., cell)| cell.and_then(|cell| cell.made.as_ref()));
    if let Some(cell) = f32_cell {
        let parameters = made().map(|made| made.bytes as f64 / made.bytes_per_parameter).next();
        let bytes = parameters.map_or_else(none, |parameters| format!("{:.0}", 4.0 * parameters));
        let figures = [success_of(cell), error_of(cell)];
        let rest = ["32", "4", "-", "-"].map(str::to_owned);
        row(text, "f32", [bytes, none(), none(), "0".to_owned()].into_iter().chain(figures).chain(rest))?;
    }
    let starred = made().any(|made| !made.default_group);
    for (method, budget, cell) in &cells {
        let Some((cell, made)) = cell.and_then(|cell| Some((cell, cell.made.as_ref()?))) else { continue };
        let figures = [
            made.bytes.to_string(),
            milliseconds(made.milliseconds),
            milliseconds(made.cmsis_nn_milliseconds),
            format!("{:.1e}", made.nmse),
            success_of(cell),
            error_of(cell),
            format!("{:.3} ({budget})", made.bpw),
            format!("{:.3}", made.bytes_per_parameter),
            format(made),
            cell.seconds.map_or_else(none, |seconds| format!("{seconds:.1}")),
        ];
        row(text, method.title(), figures)?;
    }
    writeln!(text)?;
    if starred {
        writeln!(text, "{STARRED}\n")?;
    }
    if asked.budgets.len() > 1 {
        least::write(text, &asked.methods, f32_cell, &cells)?;
    }
    reasons(text, &cells)?;
    not_driven(text, f32_cell, &cells)
}

/// Lists the impossible cells and their reasons; groups those of one method and one reason.
fn reasons(text: &mut String, cells: &[(Contender, Limit, Option<&Cell>)]) -> Result<()> {
    let mut reasons: Vec<(Contender, &str, Vec<String>)> = Vec::new();
    let mut open = Vec::new();
    for (method, budget, cell) in cells {
        let Some(cell) = cell else {
            open.push(format!("{} at {budget}", method.title()));
            continue;
        };
        let Some(why) = &cell.why else { continue };
        match reasons.iter_mut().find(|(m, known, _)| m == method && known == why) {
            Some((.., budgets)) => budgets.push(budget.title()),
            None => reasons.push((*method, why, vec![budget.title()])),
        }
    }
    for (method, why, budgets) in reasons {
        writeln!(text, "- {} at {} is not made: {why}.", method.title(), budgets.join(", "))?;
    }
    if !open.is_empty() {
        writeln!(text, "- Not run yet, or failed: {}.", open.join("; "))?;
    }
    Ok(())
}

fn not_driven(text: &mut String, f32_cell: Option<&Cell>, cells: &[(Contender, Limit, Option<&Cell>)]) -> Result<()> {
    let made = cells.iter().filter_map(|(.., cell)| cell.filter(|cell| cell.made.is_some()));
    if f32_cell
        .into_iter()
        .chain(made)
        .any(|cell| cell.driven.is_none() && cell.key.method.is_none_or(Contender::is_driven))
    {
        writeln!(
            text,
            "- Where success is `-`, there was no simulator: ACTQ_MUJOCO_PYTHON (go1_*, g1_*) and ACTQ_GYMNASIUM_PYTHON (fetch_*) \
             name the Python that has it."
        )?;
    }
    Ok(())
}

fn driven(cell: &Cell) -> Option<String> {
    success(&cell.outcome()?)
}

/// `97 (92-99)`, in percent.
fn success(outcome: &DriveOutcome) -> Option<String> {
    let percent = |share: f64| format!("{:.0}", 100.0 * share);
    let success = percent(outcome.success()?);
    Some(match outcome.interval() {
        Some([low, high]) => format!("{success} ({}-{})", percent(low.max(0.0)), percent(high)),
        None => success,
    })
}

/// Returns the first of the tracking errors that any of these cells has.
fn unit<'a>(mut cells: impl Iterator<Item = &'a Cell>) -> Option<(&'static str, &'static str)> {
    cells.find_map(|cell| {
        let outcome = cell.outcome()?;
        TRACKING.into_iter().find(|(key, _)| outcome.number(key).is_some())
    })
}

fn format(made: &Made) -> String {
    let star = if made.default_group { "" } else { "*" };
    format!("{}{star}", made.format)
}

fn header_row(text: &mut String, first: &str, names: &[String]) -> Result<()> {
    row(text, first, names.iter().cloned())?;
    writeln!(text, "|---|{}", "---:|".repeat(names.len()))?;
    Ok(())
}

fn row(text: &mut String, first: &str, values: impl IntoIterator<Item = String>) -> Result<()> {
    let values: Vec<String> = values.into_iter().collect();
    writeln!(text, "| {first} | {} |", values.join(" | "))?;
    Ok(())
}
