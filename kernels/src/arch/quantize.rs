//! A vector's scale and its integers, whichever backend computes them.

use super::{floats, integers};
use crate::error::NotFinite;
use crate::x::{Plan, Prepared, Scale};

impl Scale {
    /// The scale of `x` for integers in `-x_max ..= x_max`. `x_max` is 127 for int8 activations and at most 32767.
    pub fn new(x: &[f32], x_max: u16) -> Result<Self, NotFinite> {
        Self::of_magnitude(integers::magnitude(x), x_max)
    }

    /// Writes the integers of `x` as `plan` has it to the first [`Plan::words`] words of `out`, and names them. Missing values of
    /// `x` count as zeros. `None`, with nothing written, where `out` is shorter than [`Plan::room`]; all of that may be
    /// overwritten.
    #[inline(never)]
    pub fn quantize<'w>(self, x: &[f32], plan: &'w Plan, out: &'w mut [u32]) -> Option<Prepared<'w>> {
        let x = x.get(..plan.shape.cols).unwrap_or(x);
        floats::quantize(x, self.inverse(), plan, out)?;
        Prepared::new(out, plan)
    }
}
