//! Bundles of every family against their deploy code, made bundles, and damaged ones.

mod archives;
mod cases;
mod common;
mod images;
mod plan;
mod published;
mod references;
