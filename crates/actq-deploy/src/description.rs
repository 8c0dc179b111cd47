//! The description of everything around a policy's networks, as `deploy.toml` holds it.
//!
//! A description names *values*: raw inputs, states, clocks, motions, the networks' outputs, and what short chains of
//! operations make of them. `docs/DEPLOY.md` documents every key.

mod clock;
mod history;
mod input;
mod motion;
mod network;
mod numbers;
mod target;
mod value;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use clock::{Clock, Standing, When};
pub use history::{Fill, First, History};
pub use input::{Input, State};
pub use motion::{End, Motion};
pub use network::Network;
pub use numbers::Numbers;
pub use target::{Gains, Target, TargetKind};
pub use value::{From, Op, Operand, Order, Orientation, Value};

/// Version of the schema that this crate reads and writes.
pub const SCHEMA: u32 = 1;

/// A policy's deployment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Version of the schema: 1.
    pub schema: u32,
    /// Name of the policy.
    pub name: String,
    /// Ticks per second.
    pub rate_hz: f64,
    /// Value that is the action as the network gives it, for reports and comparisons.
    pub action: String,
    /// Lists of joint names; each is an order that inputs, values and targets refer to.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joints: BTreeMap<String, Vec<String>>,
    /// Lists of numbers that operations refer to.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub constants: BTreeMap<String, Vec<f64>>,
    /// Largest rounding of constants in the bundle's files, by their names: what a comparison with a reference leaves
    /// to it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub rounding: BTreeMap<String, f64>,
    /// Raw inputs, which the application writes in every tick.
    #[serde(default, rename = "input", skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<Input>,
    /// Values that are kept from one tick to the next.
    #[serde(default, rename = "state", skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<State>,
    /// Phases that advance with the ticks.
    #[serde(default, rename = "clock", skip_serializing_if = "Vec::is_empty")]
    pub clocks: Vec<Clock>,
    /// Tables with one row a tick.
    #[serde(default, rename = "motion", skip_serializing_if = "Vec::is_empty")]
    pub motions: Vec<Motion>,
    /// Values that operations make of other values.
    #[serde(default, rename = "value", skip_serializing_if = "Vec::is_empty")]
    pub values: Vec<Value>,
    /// Networks.
    #[serde(default, rename = "network", skip_serializing_if = "Vec::is_empty")]
    pub networks: Vec<Network>,
    /// Targets for the robot's joints.
    #[serde(default, rename = "target", skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// Gains of the joints' controllers; data for the application, which no operation reads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<Gains>,
}

impl Description {
    /// Returns the files that it names: networks, then motions; each once.
    pub fn files(&self) -> Vec<&str> {
        let networks = self.networks.iter().map(|network| network.file.as_str());
        let mut files = Vec::new();
        for file in networks.chain(self.motions.iter().map(|motion| motion.file.as_str())) {
            if !files.contains(&file) {
                files.push(file);
            }
        }
        files
    }
}
