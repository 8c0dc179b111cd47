//! The share of successful episodes, and the mean errors.

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

/// Computes the 95% interval of a share (Wilson: Probable inference, the law of succession, and statistical inference,
/// 1927).
fn wilson(successes: f64, trials: f64) -> [f64; 2] {
    /// Quantile of the normal distribution.
    const Z: f64 = 1.96;
    let (share, z2) = (successes / trials, Z * Z / trials);
    let middle = share + z2 / 2.0;
    let reach = Z * (share * (1.0 - share) / trials + z2 / (4.0 * trials)).sqrt();
    [-reach, reach].map(|side| ((middle + side) / (1.0 + z2)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_matches_worked_examples() {
        let near = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near(wilson(10.0, 10.0), [0.722, 1.0]));
        assert!(near(wilson(50.0, 100.0), [0.404, 0.596]));
        assert!(near(wilson(0.0, 20.0), [0.0, 0.161]));
    }
}
