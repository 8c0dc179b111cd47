//! The link delivers messages unchanged, and delivers no damaged, repeated or forged ones.

mod faults;
mod messages;
mod wire;
