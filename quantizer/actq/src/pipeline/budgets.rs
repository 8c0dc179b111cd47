//! Reduces every budget to a rate.

use super::quantizer::{QuantizedPolicy, Quantizer};
use super::{flash, search, time};
use crate::budget::{Budget, Rate};
use crate::data::Recordings;
use crate::error::Result;
use crate::methods::{Options, Progress};
use crate::policy::Policy;

/// Makes one image: [`Quantizer::new`] and [`Quantizer::quantize`]. `progress` receives the present work and the share
/// of it that is done.
pub fn quantize(
    policy: &Policy,
    recordings: &Recordings,
    options: &Options,
    mut progress: impl FnMut(&str, f64),
) -> Result<QuantizedPolicy> {
    flash::check_budget(policy, options)?;
    let quantizer =
        Quantizer::new(policy, recordings, options.method, options.minutes, |share| progress("calibrating", share))?;
    quantizer.quantize(options, progress)
}

impl Quantizer<'_> {
    /// Makes an image within `options.budget`. `progress` receives the present work and the share of it that is done.
    ///
    /// # Errors
    ///
    /// [`crate::budget::BudgetTooSmall`] if even the fewest bits exceed a budget of bits or bytes. The message of any
    /// other error says what is possible.
    pub fn quantize(&self, options: &Options, mut progress: impl FnMut(&str, f64)) -> Result<QuantizedPolicy> {
        let rate = match options.budget {
            Budget::Width(width) => Rate::Width(width),
            Budget::BitsPerWeight(bits) => Rate::BitsPerWeight(bits),
            Budget::ImageBytes(bytes) => return flash::within(self, options, bytes, &mut shown(progress)),
            Budget::MaxNmse(limit) => return search::smallest(self, options, limit, &mut progress),
            Budget::Time(limit) => return time::most_bits(self, options, limit, &mut shown(progress)),
        };
        self.at(rate, options, &mut shown(progress))
    }
}

/// Converts [`Progress`] to the present work and the share of it that is done.
pub(super) fn shown(mut progress: impl FnMut(&str, f64)) -> impl FnMut(Progress) {
    move |state| progress(&state.to_string(), state.share())
}
