//! Values, and the operations that make them.

use serde::{Deserialize, Serialize};

use super::history::History;

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

/// An operation on a value. A plan has places and operands that are looked up instead of named ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Op<P = Order, A = Operand> {
    /// Takes the values of these joints, or at these places, in this order.
    Select(P),
    /// Puts the values where these joints, or places, are: the reverse of `select`.
    Place(P),
    /// Adds.
    Add(A),
    /// Subtracts.
    Subtract(A),
    /// Multiplies.
    Scale(A),
    /// Divides.
    Divide(A),
    /// Raises to the first operand, then lowers to the second, as `numpy.clip`.
    Clip([A; 2]),
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

/// Representation of an orientation.
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
