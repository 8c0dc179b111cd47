//! The counted samples, and the rates that predict them.

use std::collections::BTreeMap;

use actq_kernels::cost::{Cost, CostItem};

/// A counted operation or step.
pub(super) struct Sample {
    /// Human-readable name.
    pub(super) name: String,
    pub(super) items: BTreeMap<CostItem, f64>,
    pub(super) cost: Cost,
    /// `true` if the values were drawn as the expected cost assumes.
    pub(super) expected: bool,
}

/// The cost of a unit of each item.
pub(super) type Rates = BTreeMap<CostItem, f64>;

/// Predicts the cost of a sample by these rates.
pub(super) fn predicted(sample: &Sample, rates: &Rates) -> f64 {
    sample.items.iter().map(|(item, n)| n * rates.get(item).copied().unwrap_or(0.0)).sum()
}
