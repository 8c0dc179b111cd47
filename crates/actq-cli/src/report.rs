//! Human-readable tables, notes and plots.

pub mod constants;
pub mod deployment;
pub mod export;
pub mod frontiers;
pub mod imported;
pub mod inspect;
pub mod learned;
pub mod memory;
pub mod notes;
pub mod page;
pub mod plot;
pub mod progress;
pub mod quantized;
pub mod sweep_table;
pub mod table;
pub mod time;
pub mod tuned;
pub mod widths;
