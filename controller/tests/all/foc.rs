//! Field-oriented control: against f64, against the laws of its parts, and with a motor.

mod functions;
mod motor;
mod observer;
mod parts;
