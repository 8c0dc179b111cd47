//! Specs, plans, jobs and stores, with a host that starts no processes.

mod common;
mod jobs;
mod refusals;
