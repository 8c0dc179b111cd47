//! One file for each subcommand of `actq`. Programs of other crates run [`quantize`] and [`sweep`] with methods of
//! their own.

pub(crate) mod bundle;
pub(crate) mod check;
pub(crate) mod constants;
pub(crate) mod deploy;
mod drive;
pub(crate) mod eval;
pub(crate) mod export_c;
pub(crate) mod import;
pub(crate) mod inspect;
pub(crate) mod link;
pub mod quantize;
pub(crate) mod serve;
pub(crate) mod sign;
pub mod sweep;
pub(crate) mod tune;
