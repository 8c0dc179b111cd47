//! Reduces every budget to a rate.

use super::quantizer::{QuantizedPolicy, Quantizer};
use super::watch::Watch;
use super::{flash, search, time};
use crate::budget::{Budget, Rate};
use crate::data::Recordings;
use crate::error::Result;
use crate::methods::{Options, Progress};
use crate::policy::Policy;

/// Makes one image: [`Quantizer::new`] and [`Quantizer::quantize`]. `watch` receives the present work and the share
/// of it that is done.
pub fn quantize(
    policy: &Policy,
    recordings: &Recordings,
    options: &Options,
    mut watch: impl Watch,
) -> Result<QuantizedPolicy> {
    flash::check_budget(policy, options)?;
    let quantizer = Quantizer::new(policy, recordings, options.method.clone(), options.minutes, |share| {
        watch.progress("calibrating", share)
    })?;
    quantizer.quantize(options, watch)
}

impl Quantizer<'_> {
    /// Makes an image within `options.budget`. `watch` receives the present work and the share of it that is done.
    ///
    /// # Errors
    ///
    /// [`crate::budget::BudgetTooSmall`] if even the fewest bits exceed a budget of bits or bytes. The message of any
    /// other error says what is possible.
    pub fn quantize(&self, options: &Options, mut watch: impl Watch) -> Result<QuantizedPolicy> {
        let rate = match options.budget {
            Budget::Width(width) => Rate::Width(width),
            Budget::BitsPerWeight(bits) => Rate::BitsPerWeight(bits),
            Budget::ImageBytes(bytes) => return flash::within(self, options, bytes, &mut shown(watch)),
            Budget::MaxNmse(limit) => return search::smallest(self, options, limit, &mut watch),
            Budget::Time(limit) => return time::within(self, options, limit, &mut shown(watch)),
        };
        self.at(rate, options, &mut shown(watch))
    }
}

/// Reports every [`Progress`] to `watch`.
pub(super) fn shown(mut watch: impl Watch) -> impl FnMut(Progress) {
    move |state| watch.progress(&state.to_string(), state.share())
}
