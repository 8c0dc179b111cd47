//! The table of `actq tune`.

use std::path::Path;

use actq::emit::Core;
use actq::measure::time::CLOCK;
use actq::pipeline::tune::{Round, Tuned};
use comfy_table::Table;
use serde_json::{Value, json};

use super::table;
use super::time::conditions;

/// Columns of every table, from left to right.
const HEADER: [&str; 9] = ["round", "episodes", "frames", "bytes", "ms", "f32 path", "own path", "success", "seconds"];

/// Formats a row for each image: the recordings it learned from, its bytes, time and errors, and the outcome of its
/// rollout. Each tracking error that the command printed has a column.
pub fn table(tuned: &Tuned) -> String {
    let mut tracking: Vec<&str> = tuned.rounds.iter().flat_map(|round| round.driven.keys()).collect();
    tracking.retain(|key| key.starts_with("tracking_error"));
    tracking.sort_unstable();
    tracking.dedup();
    let names: Vec<String> = tracking.iter().map(|key| key.replace('_', " ")).collect();
    let mut header = HEADER.to_vec();
    header.splice(8..8, names.iter().map(String::as_str));
    let mut rows: Table = table::table(&header);
    for round in &tuned.rounds {
        let errors = tracking.iter().map(|key| round.driven.number(key).map_or("-".to_owned(), |v| format!("{v:.3}")));
        let front = [
            round.round.to_string(),
            round.episodes.to_string(),
            round.frames.to_string(),
            round.bytes.to_string(),
            format!("{:.3}", round.milliseconds),
            format!("{:.3e}", round.nmse),
            round.own_nmse.map_or("-".to_owned(), |nmse| format!("{nmse:.3e}")),
            success(round),
        ];
        rows.add_row(front.into_iter().chain(errors).chain([format!("{:.1}", round.seconds)]));
    }
    format!(
        "{rows}\n\nEpisodes and frames: of the recordings learned from. ms: predicted time of a step, {}.\n\
         f32 path: NMSE on {}. own path: NMSE on the image's own rollout.\n",
        conditions(Core::M4f, CLOCK),
        tuned.measured_on
    )
}

/// Returns the same as a JSON object.
pub fn json(tuned: &Tuned, policy: &str, command: &str) -> Value {
    json!({
        "policy": policy,
        "drive": command,
        "measured_on": tuned.measured_on,
        "rounds": tuned.rounds,
    })
}

/// Returns a note if an earlier image had more success than the last. `kept` is the folder of `--keep`.
pub fn better(tuned: &Tuned, kept: Option<&Path>) -> Option<String> {
    let (better, last) = (tuned.better()?, tuned.rounds.last()?);
    let place = match kept {
        Some(dir) => format!("it is {}", dir.join(format!("round-{}.actq", better.round)).display()),
        None => "pass --keep DIR to keep it".to_owned(),
    };
    Some(format!(
        "the image of round {} has more success ({}) than the last one ({}), which was written; {place}. If the intervals \
         overlap, run more episodes to decide",
        better.round,
        success(better),
        success(last)
    ))
}

fn success(round: &Round) -> String {
    let Some(success) = round.driven.success() else { return "-".to_owned() };
    let interval = round.driven.interval().map_or(String::new(), |[low, high]| format!(" ({low:.3}-{high:.3})"));
    format!("{success:.3}{interval}")
}
