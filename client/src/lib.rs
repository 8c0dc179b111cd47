//! The host's end of the link to a motor controller (`docs/LINK.md`), behind `actq link`, `actq keygen` and
//! `actq sign`.
//!
//! A [`port::Address`] is opened as a [`connection::Connection`], which is opened again where it breaks. A
//! [`client::Client`] asks over it and repeats what was not answered; [`push`] sends an image, [`stream`] a recording's
//! observations, [`serve`] those of a simulator, and [`log`] keeps what came back. [`keys`] makes keys and signatures.
#![forbid(unsafe_code)]

// Which of these may use which: the table in docs/ARCHITECTURE.md, which a test reads.
pub mod client;
pub mod connection;
pub mod event;
pub mod keys;
pub mod log;
pub mod port;
pub mod push;
pub mod serve;
pub mod stream;
