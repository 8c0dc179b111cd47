//! What a controller says, kept.

use actq_link::Message;
use actq_link::code::{Parameter, Refusal};
use actq_link::report::{Breadcrumb, Status, Timing};

/// A message of a controller.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// An action.
    Action {
        /// Sequence number of its observation.
        of: u32,
        /// Whether the outputs follow it.
        applied: bool,
        /// The controller's time in µs.
        micros: u32,
        /// Its values.
        values: Vec<f32>,
    },
    /// A status.
    Status(Status),
    /// Times.
    Timing(Timing),
    /// What the last run left behind.
    Breadcrumb(Breadcrumb),
    /// A parameter.
    Value {
        /// Which.
        parameter: Parameter,
        /// Whose.
        axis: u8,
        /// What it is.
        value: f32,
    },
    /// An acknowledgement.
    Ack {
        /// Sequence number of the request.
        of: u32,
        /// Why it was not done.
        refusal: Option<Refusal>,
        /// Bytes of the update that were taken.
        written: u32,
    },
}

impl Event {
    /// What a controller may say; `None` for what only a host says.
    pub fn of(message: &Message<'_>, micros: u32) -> Option<Self> {
        Some(match *message {
            Message::Action { of, applied, values } => {
                Self::Action { of, applied, micros, values: values.iter().collect() }
            }
            Message::Status(status) => Self::Status(status),
            Message::Timing(timing) => Self::Timing(timing),
            Message::Breadcrumb(breadcrumb) => Self::Breadcrumb(breadcrumb),
            Message::Value { parameter, axis, value } => Self::Value { parameter, axis, value },
            Message::Ack { of, refusal, written } => Self::Ack { of, refusal, written },
            _ => return None,
        })
    }
}
