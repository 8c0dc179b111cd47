//! Unused parts of budgets.

use actq_kernels::Width;

use super::quantizer::QuantizedPolicy;
use crate::budget::{Budget, MIN_USED_SHARE};
use crate::methods::distill::balance::balance_bytes;
use crate::methods::{Method, Options, Outcome};

/// Least predicted error of a row that affects the actions.
const NONE: f64 = 1e-12;

/// A budget with a large unused part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unused {
    /// Bytes of the image, or bits per weight.
    pub used: f64,
    /// Allowed bytes or bits per weight.
    pub allowed: f64,
    /// Reason for the unused part.
    pub reason: Reason,
}

/// Reason for the unused part of a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Every row has the most bits that it may have.
    Widest,
    /// More bits do not reduce the error: the other rows do not affect the actions.
    NoError,
    /// The next rows or matrices with more bits take more than the rest.
    Step,
}

impl Unused {
    /// Returns the unused part for an image made with `options`; `None` if the budget is used, or is not of bits or
    /// bytes.
    pub fn of(found: &QuantizedPolicy, options: &Options) -> Option<Self> {
        let (used, allowed) = match options.budget {
            Budget::ImageBytes(bytes) => (found.image.len() as f64, bytes as f64),
            Budget::BitsPerWeight(bits) => (bits_per_weight(found), bits),
            Budget::Width(_) | Budget::MaxNmse(_) | Budget::Time(_) => return None,
        };
        (used < MIN_USED_SHARE * allowed).then(|| Self { used, allowed, reason: reason(found, options) })
    }
}

/// Returns the bits per weight as the budget counts them.
fn bits_per_weight(found: &QuantizedPolicy) -> f64 {
    let bytes: usize = found.outcomes.iter().map(Outcome::bytes).sum();
    let weights: usize = found.outcomes.iter().map(Outcome::trained_weights).sum();
    8.0 * (bytes + balance_bytes(&found.policy.graph)) as f64 / weights.max(1) as f64
}

fn reason(found: &QuantizedPolicy, options: &Options) -> Reason {
    let widest = match &options.method {
        Method::Custom(method) => method.widest(),
        _ => Width::W8,
    };
    let is_free = |m: usize| options.forced.iter().all(|(name, _)| *name != found.policy.graph.matrices[m].name);
    let free = found.outcomes.iter().enumerate().filter(|(m, _)| is_free(*m)).map(|(_, outcome)| outcome);
    let narrow = free.flat_map(|outcome| {
        let rows = outcome.trained_widths().iter().zip(outcome.expected_errors());
        rows.filter(|(width, _)| **width < Some(widest)).map(|(_, error)| error)
    });
    match narrow.reduce(f64::max) {
        None => Reason::Widest,
        Some(error) if error <= NONE => Reason::NoError,
        Some(_) => Reason::Step,
    }
}
