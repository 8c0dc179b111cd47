//! A description under construction.

use actq::error::Result;

use super::super::common::Parts;
use super::lengths::count;
use super::robot::Robot;
use crate::description::Op;
use crate::document::Document;
use crate::facts::Facts;

/// A term: its raw value, operations and length.
pub(super) struct Term {
    pub(super) from: String,
    pub(super) ops: Vec<Op>,
    pub(super) len: usize,
    /// Length that the file must state, which is that without a selection of joints.
    pub(super) stated: usize,
}

/// A description under construction.
pub(super) struct Reader<'a> {
    pub(super) yaml: &'a Document,
    pub(super) parts: Parts,
    pub(super) facts: &'a mut Facts,
    pub(super) rate: f64,
    /// Key of the terms' lengths.
    pub(super) dims: String,
    /// Length of the action, if known, and its source.
    pub(super) action_len: Option<usize>,
    pub(super) action_len_from: String,
    pub(super) robot: Robot,
    /// Places of the joints that the policy reads and moves; none for all.
    pub(super) active: Option<Vec<usize>>,
    /// Length of the reference motion in s.
    pub(super) motion: Option<f64>,
    pub(super) has_phase: bool,
}

impl Reader<'_> {
    /// Returns the length of a term that the file states.
    pub(super) fn dim(&self, term: &str) -> Result<usize> {
        self.yaml.required(&format!("{}.{term}", self.dims), "a number of values", count)
    }

    pub(super) fn raw(&mut self, name: &str, len: usize, unit: &str) -> Term {
        self.parts.raw(name, len, unit);
        Term { from: name.to_owned(), ops: Vec::new(), len, stated: len }
    }
}
