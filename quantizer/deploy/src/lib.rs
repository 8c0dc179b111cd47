//! What surrounds a robot policy's network: raw inputs, histories, clocks, joint orders and targets.
#![deny(unsafe_code)]

mod bundle;
mod clock;
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
mod run;
mod sources;
pub mod yaml;

pub use bundle::Bundle;
pub use document::Document;
pub use facts::{Answers, Facts, Profile, Question, Rule};
pub use families::FAMILIES;
pub use family::{Family, Found, Reading, read};
pub use label::Label;
pub use plan::Plan;
pub use reference::{Comparison, Difference, Reference, TOLERANCE};
pub use run::{Runner, Tick};
pub use sources::{Array, Compute, Sources};
