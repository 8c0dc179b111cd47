//! The share of successful episodes, and the mean errors.

use actq::measure::interval::wilson;
use serde_json::{Value, json};

use crate::task::Outcome;

/// Summarizes a run over episodes: `episodes`, `success` (their share), `ci` (its 95% interval), and the mean errors
/// over the hold phases.
pub fn summary(outcomes: &[Outcome]) -> Value {
    let successes = outcomes.iter().filter(|outcome| outcome.success).count();
    let mean = |part: fn(&Outcome) -> f64| outcomes.iter().map(part).sum::<f64>() / outcomes.len() as f64;
    json!({
        "episodes": outcomes.len(),
        "success": successes as f64 / outcomes.len() as f64,
        "ci": wilson(successes as f64, outcomes.len() as f64),
        "final_error_mm": 1e3 * mean(|outcome| outcome.final_error_m),
        "tracking_error_mm": 1e3 * mean(|outcome| outcome.tracking_error_m),
        "axis_error_mrad": 1e3 * mean(|outcome| outcome.axis_error_rad),
    })
}
