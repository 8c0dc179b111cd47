//! The result of a rollout of an image by a robot or simulator.

use serde::Serialize;
use serde_json::{Map, Value};

use crate::data::Dataset;

/// A rollout: the observations that the image received, and its reported outcome.
#[derive(Clone, Debug)]
pub struct Driven {
    /// Observations that the image received, with or without the f32 policy's actions.
    pub recordings: Vec<Dataset>,
    /// Reported outcome.
    pub outcome: DriveOutcome,
}

/// The reported outcome of a rollout: `success` (a share), its interval `ci`, and any other numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct DriveOutcome(Map<String, Value>);

impl DriveOutcome {
    /// Parses a line that is one JSON object, and keeps its numbers and `ci`; `None` for any other line.
    pub fn parse(line: &str) -> Option<Self> {
        let Ok(Value::Object(mut object)) = serde_json::from_str(line) else { return None };
        object.retain(|key, value| value.is_number() || key == "ci" && interval(value).is_some());
        Some(Self(object))
    }

    /// Returns a reported number.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.0.get(key)?.as_f64()
    }

    /// Returns the share of successful episodes.
    pub fn success(&self) -> Option<f64> {
        self.number("success")
    }

    /// Returns the interval of [`Self::success`].
    pub fn interval(&self) -> Option<[f64; 2]> {
        interval(self.0.get("ci")?)
    }

    /// Returns the names of all numbers.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|(_, value)| value.is_number()).map(|(key, _)| key.as_str())
    }
}

fn interval(value: &Value) -> Option<[f64; 2]> {
    let [low, high] = &value.as_array()?[..] else { return None };
    Some([low.as_f64()?, high.as_f64()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_lines_are_parsed_for_their_numbers() {
        let outcome = DriveOutcome::parse(
            r#" {"success": 0.92, "ci": [0.85, 0.96], "episodes": 100, "task": "reach", "tracking_error_mm": 1.5} "#,
        );
        let outcome = outcome.expect("an object");
        assert_eq!((outcome.success(), outcome.interval()), (Some(0.92), Some([0.85, 0.96])));
        assert_eq!(outcome.keys().collect::<Vec<_>>(), ["episodes", "success", "tracking_error_mm"]);
        assert_eq!(outcome.number("task"), None);
        for other in ["", "3 of 4", "[1]", "1", "{\"success\": }", "{\"success\": 1} {}", "{\"success\": NaN}"] {
            assert_eq!(DriveOutcome::parse(other), None, "{other}");
        }
        let odd = DriveOutcome::parse(r#"{"success": "all", "ci": [1]}"#).expect("an object");
        assert_eq!((odd.success(), odd.interval()), (None, None));
    }
}
