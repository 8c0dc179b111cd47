//! The tests that learn for tens of seconds. `cargo verify --all` runs them; `cargo verify` has the learner's unit
//! tests, those of the command, and the smoke run.

mod compare;
mod distill;
mod flow;
mod recorded;
mod units;
