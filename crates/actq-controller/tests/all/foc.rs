//! Field-oriented control: against f64, against properties of its parts, and with a simulated motor.

mod functions;
mod motor;
mod observer;
mod parts;
