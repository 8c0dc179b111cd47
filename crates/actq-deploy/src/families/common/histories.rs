//! Conventions of a family's histories.

use actq::error::Result;

use crate::description::{Fill, First, History};
use crate::facts::Facts;

/// Conventions of a family's histories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Histories {
    /// All frames of a term, then the next term; otherwise all terms of a frame.
    pub(crate) by_term: bool,
    pub(crate) first: First,
    pub(crate) fill: Fill,
    /// Ticks from a frame to the next.
    pub(crate) stride: usize,
}

impl Histories {
    /// Asks for the rules history.layout, history.first and history.fill.
    pub(crate) fn of(facts: &mut Facts) -> Result<Self> {
        let by_term = facts.is_choice("history.layout", "term")?;
        Self::laid_out(by_term, facts)
    }

    /// Asks for the rules history.first and history.fill; a file states the layout.
    pub(crate) fn laid_out(by_term: bool, facts: &mut Facts) -> Result<Self> {
        Ok(Self {
            by_term,
            first: facts.value_or_default("history.first")?,
            fill: facts.value_or_default("history.fill")?,
            stride: 1,
        })
    }

    pub(crate) fn spec(&self, length: usize) -> History {
        History { length, stride: self.stride, first: self.first, fill: self.fill, current: true }
    }
}
