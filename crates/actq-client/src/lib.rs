//! The host's end of the link to a motor controller (`docs/LINK.md`): the library of `actq link`, `actq keygen` and
//! `actq sign`.
//!
//! A [`connection::Connection`] opens a [`port::Address`] and reopens it when it breaks. A [`client::Client`] sends
//! requests over it and repeats unanswered ones. [`push`] sends an image, [`stream`] a recording's observations,
//! [`serve`] those of a simulator, and [`log`] records the actions. [`keys`] creates keys and signatures.
#![forbid(unsafe_code)]

pub mod client;
pub mod connection;
pub mod event;
pub mod keys;
pub mod log;
pub mod port;
pub mod push;
pub mod serve;
pub mod stream;
