//! What was counted, and the rates that predict it.

use std::collections::BTreeMap;

use actq_kernels::pace::cost::{Cost, Feature};

/// A counted operation or step.
pub(super) struct Sample {
    /// What it is, for people.
    pub(super) name: String,
    pub(super) features: BTreeMap<Feature, f64>,
    pub(super) cost: Cost,
    /// Whether the values were drawn as the expected cost has them.
    pub(super) expected: bool,
}

/// What a unit of each feature costs.
pub(super) type Rates = BTreeMap<Feature, f64>;

/// The cost of a sample by these rates.
pub(super) fn predicted(sample: &Sample, rates: &Rates) -> f64 {
    sample.features.iter().map(|(feature, n)| n * rates.get(feature).copied().unwrap_or(0.0)).sum()
}
