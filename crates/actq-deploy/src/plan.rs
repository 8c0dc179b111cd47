//! A checked description: every name resolved, every length known, and the values in an order in which they can be
//! computed.

mod builder;
mod chain;
mod names;
mod numbers;
mod parts;

pub use parts::Plan;
pub(crate) use parts::{Arg, Feed, Planned, PlannedOp, PlannedTarget, TickStep, ValueIndex, ValueSource};
