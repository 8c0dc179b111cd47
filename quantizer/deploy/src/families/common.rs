//! Parts that several families share.

pub(super) mod action;
mod graph;
mod gravity;
mod histories;
mod lists;
mod parts;
pub(super) mod terms;

pub(super) use graph::{Graph, Ports, known, listed, metadata_document};
pub(super) use gravity::{given_gravity, gravity};
pub(super) use histories::Histories;
pub(super) use lists::{check_names, count, counts, names, numbers};
pub(super) use parts::{ACTION, Parts};
