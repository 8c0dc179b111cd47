//! One file for each subcommand of `actq`. Programs of other crates run [`quantize`] and [`sweep`] with methods of
//! their own, and read bundles and write exports as the command does.

pub mod bundle;
pub(crate) mod check;
pub(crate) mod constants;
pub(crate) mod deploy;
mod drive;
pub(crate) mod eval;
pub mod export_c;
pub(crate) mod import;
pub(crate) mod inspect;
pub mod jobs;
pub(crate) mod link;
pub mod quantize;
pub(crate) mod repack;
pub mod report;
pub(crate) mod serve;
pub(crate) mod sign;
pub mod sweep;
pub(crate) mod tune;
