//! What surrounds a robot policy's network: raw inputs, histories, clocks, joint orders and targets.
#![deny(unsafe_code)]

mod bundle;
mod clock;
mod conventions;
pub mod description;
mod document;
mod facts;
mod families;
mod family;
mod history;
mod label;
mod network;
mod plan;
mod reference;
mod report;
mod run;
mod sources;
mod text;
pub mod yaml;

pub use bundle::Bundle;
pub use conventions::{Variant, variants};
pub use document::Document;
pub use facts::{Answers, Facts, Profile, Question, Rule};
pub use families::FAMILIES;
pub use family::{DESCRIPTION, Family, Found, Reading, read};
pub use label::Label;
pub use plan::Plan;
pub use reference::{Comparison, Difference, Raw, Reference, TOLERANCE, explain};
pub use report::Row;
pub use run::{Runner, Tick};
pub use sources::{Array, Compute, Sources};
