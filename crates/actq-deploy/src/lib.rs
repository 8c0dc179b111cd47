//! Surroundings of a robot policy's network: raw inputs, histories, clocks, joint orders and targets.
#![deny(unsafe_code)]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod archive;
mod bundle;
mod clock;
mod compile;
mod conventions;
pub mod description;
mod document;
mod facts;
mod families;
mod family;
mod history;
mod importer;
mod label;
mod nearest;
mod network;
mod orders;
mod plan;
mod reading;
mod reference;
mod report;
mod run;
mod sources;
mod text;
mod verify;
mod yaml;

pub use bundle::Bundle;
pub use compile::Deployment;
pub use conventions::{Variant, variants};
pub use facts::{Answers, Question};
pub use importer::{DeployFolder, observed, targets};
pub use label::Label;
pub use orders::orders;
pub use plan::Plan;
pub use reading::{DESCRIPTION, Reading, read};
pub use reference::{Comparison, Difference, Raw, Reference, TOLERANCE, explain};
pub use report::Row;
pub use run::{Noise, Runner, Tick};
pub use sources::{Array, Compute, Part, Sources};
pub use verify::ROUNDING;
