//! Parts that several families share.

pub(super) mod action;
mod graph;
mod gravity;
mod histories;
mod lists;
mod parts;
pub(super) mod terms;

pub(crate) use graph::metadata_document;
pub(super) use graph::{Graph, Ports, known, listed};
pub(super) use gravity::{given_gravity, gravity};
pub(super) use histories::Histories;
pub(super) use lists::{check_names, count, counts, names, numbers};
pub(super) use parts::{ACTION, Parts};
