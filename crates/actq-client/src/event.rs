//! A controller's messages, with owned data.

use actq_link::Message;
use actq_link::code::{Parameter, Refusal};
use actq_link::report::{Breadcrumb, Status, Timing};

/// A message of a controller.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// An action.
    Action {
        /// Sequence number of the observation's frame.
        of: u32,
        /// `true` if the outputs follow the action.
        applied: bool,
        /// The controller's time in µs.
        micros: u32,
        /// The values.
        values: Vec<f32>,
    },
    /// A status.
    Status(Status),
    /// The measured times.
    Timing(Timing),
    /// The crash record of the last run.
    Breadcrumb(Breadcrumb),
    /// The value of a parameter.
    Value {
        /// The parameter.
        parameter: Parameter,
        /// The axis, for a parameter of an axis; else 0.
        axis: u8,
        /// The current value.
        value: f32,
    },
    /// An acknowledgement.
    Ack {
        /// Sequence number of the request's frame.
        of: u32,
        /// Reason for a refusal; `None` if the request was done.
        refusal: Option<Refusal>,
        /// Accepted bytes of the update.
        written: u32,
    },
}

impl Event {
    /// Converts a controller's message; `None` for a message that only a host sends.
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
