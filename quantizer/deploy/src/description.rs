//! The description of everything around a policy's networks, as `deploy.toml` holds it.
//!
//! A description names *values*: raw inputs, states, clocks, motions, the networks' outputs, and what short chains of
//! operations make of them. `docs/DEPLOY.md` documents every key.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the schema that this crate reads and writes.
pub const SCHEMA: u32 = 1;

/// A policy's deployment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Version of the schema: 1.
    pub schema: u32,
    /// Name of the policy.
    pub name: String,
    /// Ticks a second.
    pub rate_hz: f64,
    /// Value that is the action as the network gives it, for reports and comparisons.
    pub action: String,
    /// Lists of joint names; each is an order that inputs, values and targets refer to.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joints: BTreeMap<String, Vec<String>>,
    /// Lists of numbers that operations refer to.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub constants: BTreeMap<String, Vec<f64>>,
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
    /// What the robot gets.
    #[serde(default, rename = "target", skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// Gains of the joints' controllers; data for the application, which no operation reads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gains: Option<Gains>,
}

impl Description {
    /// Returns the files that it names: networks, then motions; each one time.
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

/// A raw input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Name.
    pub name: String,
    /// Number of values; may be omitted with `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub len: Option<usize>,
    /// Order of its values: a list of `joints`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joints: Option<String>,
    /// Unit, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Lowest and highest value that a guard accepts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
}

/// A value that is kept from one tick to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Name.
    pub name: String,
    /// Number of values.
    pub len: usize,
    /// Its value in the first tick after a reset; one number stands for all.
    #[serde(default, skip_serializing_if = "Numbers::is_zero")]
    pub start: Numbers,
    /// Value of this tick that it has in the next.
    pub next: String,
}

/// A phase.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clock {
    /// Name.
    pub name: String,
    /// Phases at a reset, one for each leg or one in all.
    pub start: Vec<f64>,
    /// Advance in a tick.
    pub advance: f64,
    /// Time of the advance: before or after the tick reads it.
    #[serde(default)]
    pub when: When,
    /// Interval that phases are wrapped to: from the first number, to below the second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrap: Option<[f64; 2]>,
    /// Number above which a phase restarts at 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart_above: Option<f64>,
    /// Phases of a robot that stands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standing: Option<Standing>,
}

/// When a clock advances.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// Before the tick reads it: the first tick has one advance.
    Before,
    /// After the tick has read it: the first tick has the start.
    #[default]
    After,
}

/// Condition under which a robot stands, and its clock's phases then. When it moves again, the clock restarts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standing {
    /// Values whose Euclidean norms decide, each by itself.
    pub of: Vec<String>,
    /// The robot stands if every norm is below this number.
    pub below: f64,
    /// Phases while it stands.
    pub at: Vec<f64>,
}

/// A table with one row a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Name.
    pub name: String,
    /// File beside the description: .npz or .npy.
    pub file: String,
    /// Array `[row, value]` in the file.
    pub array: String,
    /// Ticks by which the rows are late: row 0 is read until tick `lag`.
    #[serde(default)]
    pub lag: usize,
    /// What follows the last row.
    #[serde(default)]
    pub end: End,
}

/// What follows the last row of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The last row stays.
    #[default]
    Hold,
    /// The first row comes again.
    Repeat,
}

/// A value that operations make of other values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Value {
    /// Name.
    pub name: String,
    /// The value, or several one after the other.
    pub from: From,
    /// Operations in order.
    #[serde(default, rename = "do", skip_serializing_if = "Vec::is_empty")]
    pub ops: Vec<Op>,
}

/// One value's name, or several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum From {
    /// One value.
    One(String),
    /// Values one after the other.
    Many(Vec<String>),
}

impl From {
    /// Returns the names.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Many(names) => names,
        }
    }
}

/// One number for all values, or one for each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Numbers {
    /// For all.
    All(f64),
    /// For each.
    Each(Vec<f64>),
}

impl Default for Numbers {
    fn default() -> Self {
        Self::All(0.0)
    }
}

impl Numbers {
    fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// Second operand of an operation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Operand {
    /// A number for all values.
    Number(f64),
    /// A number for each value.
    List(Vec<f64>),
    /// A list of `constants`, or a value of this tick.
    Name(String),
}

/// An operation on a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Op {
    /// Takes the values of these joints, or at these places, in this order.
    Select(Order),
    /// Puts the values where these joints, or places, are: the reverse of `select`.
    Place(Order),
    /// Adds.
    Add(Operand),
    /// Subtracts.
    Subtract(Operand),
    /// Multiplies.
    Scale(Operand),
    /// Divides.
    Divide(Operand),
    /// Limits to the first and the second operand.
    Clip([Operand; 2]),
    /// Wraps angles in rad to the interval from -pi to below pi.
    Wrap,
    /// Makes the direction of gravity in the body's frame of its orientation.
    Gravity(Orientation),
    /// Takes the sine of angles in rad.
    Sin,
    /// Takes the cosine of angles in rad.
    Cos,
    /// Takes the Euclidean norm.
    Norm,
    /// Puts the values of several ticks one after the other.
    History(History),
}

/// An order of values.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Order {
    /// A list of `joints`.
    Joints(String),
    /// Places, from 0.
    Places(Vec<usize>),
}

/// How an orientation is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Orientation {
    /// A quaternion, its real part first.
    Wxyz,
    /// A quaternion, its real part last.
    Xyzw,
    /// Roll, pitch and yaw in rad: rotations about x, then y, then z of the world.
    Rpy,
}

/// A history.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Number of frames.
    pub length: usize,
    /// Ticks from a frame to the next.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub stride: usize,
    /// Which frame comes first.
    #[serde(default)]
    pub first: First,
    /// What frames before the first tick hold.
    #[serde(default)]
    pub fill: Fill,
    /// Whether the newest frame is that of this tick, or of the tick before.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub current: bool,
}

fn one() -> usize {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_one(n: &usize) -> bool {
    *n == 1
}

fn yes() -> bool {
    true
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_yes(flag: &bool) -> bool {
    *flag
}

/// The frame that comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum First {
    /// The oldest.
    #[default]
    Oldest,
    /// The newest.
    Newest,
}

/// Content of a history after a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Zeros.
    #[default]
    Zero,
    /// The frame of the first tick.
    First,
}

/// A network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Network {
    /// Name; `NAME.OUTPUT` names the value of an output.
    pub name: String,
    /// ONNX file beside the description.
    pub file: String,
    /// Value of each of the graph's inputs.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, String>,
    /// Inputs that take the value of an output of the tick before, and that output; zero at a reset.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub states: BTreeMap<String, String>,
}

/// What the robot gets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// What it is.
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
