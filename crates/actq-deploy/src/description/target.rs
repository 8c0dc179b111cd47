//! Targets for the robot's joints.

use serde::{Deserialize, Serialize};

use super::numbers::Numbers;

/// A target for the robot's joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Quantity of its values.
    pub kind: TargetKind,
    /// Its value.
    pub value: String,
    /// Order of its values: a list of `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<String>,
    /// Lowest and highest value, which the image keeps and a controller needs to arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[Numbers; 2]>,
}

/// Kind of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetKind {
    /// Joint positions in rad or m.
    Position,
    /// Joint velocities in rad/s or m/s.
    Velocity,
    /// Joint torques in N m, or forces in N.
    Torque,
}

/// Gains of the joints' controllers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Order of the lists: a list of `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<String>,
    /// Torque per position error, N m/rad.
    pub stiffness: Vec<f64>,
    /// Torque per velocity, N m s/rad.
    pub damping: Vec<f64>,
}
