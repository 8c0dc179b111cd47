//! Human-readable tables and notes, and a page.

pub mod constants;
pub mod deployment;
pub mod export;
pub mod imported;
pub mod inspect;
pub mod learned;
pub mod memory;
pub mod notes;
pub mod page;
pub mod progress;
pub mod quantized;
pub mod sweep_table;
pub mod table;
pub mod time;
pub mod tuned;
pub mod widths;
