//! Sweeps as jobs: a [`spec::Spec`] becomes a plan of [`job::Job`]s, [`run::run`] runs one, a [`store::Store`] holds
//! the results, and [`results`] has the results of a whole plan.
//!
//! A job's result depends on its address alone, the SHA-256 of what goes into it: not on the machine, the number of
//! threads, or the time. Nothing here starts processes or prints; what the caller has to provide is [`host::Host`].
//!
//! `docs/SCALE.md` documents the files.
#![deny(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod digest;
pub mod error;
pub mod estimate;
pub mod figures;
pub mod frontier;
pub mod host;
pub mod job;
pub mod order;
pub mod plan;
pub mod record;
pub mod results;
pub mod run;
pub mod schedule;
mod source;
pub mod spec;
pub mod store;
pub mod work;
