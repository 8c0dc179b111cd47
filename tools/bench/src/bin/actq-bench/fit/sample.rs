//! The counted samples, and the rates that predict them.

use std::collections::BTreeMap;

use actq_kernels::pace::cost::{Cost, Feature};

/// A counted operation or step.
pub(super) struct Sample {
    /// Human-readable name.
    pub(super) name: String,
    pub(super) features: BTreeMap<Feature, f64>,
    pub(super) cost: Cost,
    /// `true` if the values were drawn as the expected cost assumes.
    pub(super) expected: bool,
}

/// The cost of a unit of each feature.
pub(super) type Rates = BTreeMap<Feature, f64>;

/// Predicts the cost of a sample by these rates.
pub(super) fn predicted(sample: &Sample, rates: &Rates) -> f64 {
    sample.features.iter().map(|(feature, n)| n * rates.get(feature).copied().unwrap_or(0.0)).sum()
}
