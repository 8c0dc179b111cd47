//! Reports on an imported deploy bundle.

use std::collections::BTreeMap;
use std::ops::Range;

use actq::text::{count, printable};
use actq_deploy::description::{Description, Target as Described};
use actq_deploy::{Array, Comparison, Question, Reading, TOLERANCE};

use super::table::table;

/// Most keys that a note lists.
const MAX_KEYS: usize = 40;

/// Formats the parts of a description, each with its source.
pub fn summary(reading: &Reading) -> String {
    let mut parts = table(&["part", "name", "content", "source"]);
    for column in parts.column_iter_mut() {
        column.set_cell_alignment(comfy_table::CellAlignment::Left);
    }
    for row in reading.description.rows() {
        let source = reading.sources.get(&row.name).cloned().unwrap_or_default();
        parts.add_row([row.section.to_owned(), row.name, row.content, source]);
    }
    let rate = (reading.description.rate_hz * 1e6).round() / 1e6;
    let profile = reading.profile.as_ref().map_or(String::new(), |[upstream, commit]| {
        format!("; its profile was read from {upstream} at {}", commit.get(..12).unwrap_or(commit))
    });
    format!(
        "family    {}{profile}\nrate      {rate} Hz\naction    {}\n\n{parts}\n\n",
        reading.family, reading.description.action
    )
}

/// Formats open questions.
pub fn questions(questions: &[Question]) -> String {
    let mut text = String::new();
    for question in questions {
        text += &format!("  {}: {}\n", question.key, question.meaning);
        if let Some((value, source)) = &question.profile {
            text += &format!("      {} = {value}, says {source}\n", question.key);
        }
    }
    text
}

/// Formats the keys that nothing reads, as a note.
pub fn unread(keys: &[String]) -> Option<String> {
    let more = keys.len().saturating_sub(MAX_KEYS);
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    let listed = keys[..keys.len().min(MAX_KEYS)].join("; ");
    (!keys.is_empty()).then(|| format!("nothing reads these keys of the bundle: {listed}{more}"))
}

/// Formats the targets without limits, as a note.
pub fn without_limits(description: &Description) -> Option<String> {
    let without = |target: &&Described| target.limits.is_none();
    let names: Vec<&str> = description.targets.iter().filter(without).map(|target| target.value.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the bundle states no limits for {}: a motor controller refuses to arm without them; pass --limits LOW:HIGH, or add limits = \
             [LOW, HIGH] to its [[target]] in deploy.toml, each a number or one for each joint",
            names.join(", ")
        )
    })
}

/// Formats an agreement with a reference.
pub fn agreement(comparison: &Comparison) -> String {
    let of = |shares: &BTreeMap<&str, f64>| {
        shares.iter().map(|(kind, share)| format!("{kind} {share:.1e}")).collect::<Vec<_>>().join(", ")
    };
    let mut text = format!(
        "checked   {} ticks agree; largest difference, as a share of the largest value: {}\n",
        comparison.ticks,
        of(&comparison.largest)
    );
    let fed = |kind: &str| comparison.largest.get(kind).copied().unwrap_or(0.0);
    // Differences that are there with recorded actions, too, are no drift.
    if comparison.drift.iter().any(|(kind, share)| *share > TOLERANCE.max(2.0 * fed(kind))) {
        text += &format!(
            "drift     with its own actions fed back instead of the recorded ones, rounding adds up to: {}\n",
            of(&comparison.drift)
        );
    }
    for (kind, [most, of]) in &comparison.rounded {
        text += &format!(
            "rounding  {kind} differs by up to {most:.1e}: the bundle's file rounds constants (rounding in deploy.toml), which explains up \
             to {of:.1e}; give exact constants there\n"
        );
    }
    text
}

/// Formats the expected targets that limits hold back, as a note.
pub fn held(comparison: &Comparison) -> Option<String> {
    (comparison.held > 0).then(|| {
        format!(
            "{} of the reference are beyond the limits of [[target]], which hold them there; they are compared at the limits",
            count(comparison.held, "target")
        )
    })
}

/// Largest error of a target's value that never varies, of 1 plus its magnitude.
const CONSTANT: f64 = 1e-4;

/// Error of a target over a reference.
pub(crate) struct Target {
    name: String,
    /// Squared error over variance, mean over the values that vary.
    pub(crate) nmse: f64,
    largest: f64,
    /// Tick and value of the largest error.
    at: [usize; 2],
}

impl Target {
    /// Compares the values `place` of each tick.
    pub(crate) fn new(name: &str, place: Range<usize>, found: &[Vec<f32>], expected: &Array) -> Self {
        let row = expected.values.len() / found.len().max(1);
        let (mut largest, mut at) = (0.0, [0, 0]);
        let (mut sum, mut count) = (0.0, 0);
        for value in place.clone() {
            let of = |tick: usize| expected.values[tick * row + value];
            let mean = (0..found.len()).map(of).sum::<f64>() / found.len() as f64;
            let (mut energy, mut error) = (0.0, 0.0);
            for (tick, found) in found.iter().enumerate() {
                let difference = (f64::from(found[value]) - of(tick)).abs();
                energy += (of(tick) - mean).powi(2);
                error += difference.powi(2);
                if difference > largest {
                    (largest, at) = (difference, [tick, value - place.start]);
                }
            }
            if energy > 0.0 {
                (sum, count) = (sum + error / energy, count + 1);
            } else if error > found.len() as f64 * (CONSTANT * (1.0 + mean.abs())).powi(2) {
                // It has no variance to compare with, but is wrong.
                (sum, count) = (f64::INFINITY, count + 1);
            }
        }
        Self { name: name.to_owned(), nmse: sum / f64::from(count.max(1)), largest, at }
    }
}

/// Formats the errors of targets.
pub(crate) fn targets(targets: &[Target], ticks: usize) -> String {
    let mut rows = table(&["target", "nmse", "largest error", "at tick", "value"]);
    for Target { name, nmse, largest, at: [tick, value] } in targets {
        let cells = [printable(name).to_string(), format!("{nmse:.3e}"), format!("{largest:.4}")];
        rows.add_row(cells.into_iter().chain([tick.to_string(), value.to_string()]));
    }
    let ticks = count(ticks, "tick");
    format!("{rows}\n\n{ticks}; nmse: squared error / variance of the expected target, mean over values\n")
}
