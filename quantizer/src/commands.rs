//! One file for each subcommand of `actq`.

mod bundle;
mod drive;
pub(crate) mod eval;
pub(crate) mod import;
pub(crate) mod inspect;
pub(crate) mod link;
pub(crate) mod quantize;
pub(crate) mod serve;
pub(crate) mod sign;
pub(crate) mod sweep;
pub(crate) mod tune;
