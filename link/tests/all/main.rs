//! The link: what is sent arrives as it was, and what is damaged, repeated or made up does not arrive at all.

mod faults;
mod messages;
mod random;
mod wire;
