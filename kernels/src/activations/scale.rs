//! The scale between a vector of f32 and its integers.

use crate::error::NotFinite;

/// Least magnitude, 2^-100. A vector without a larger one counts as zero, so that the reciprocal of the scale is
/// finite.
pub const TINY: f32 = f32::from_bits(27 << 23);

/// The scale of a vector: `x[i]` is about `scale * q[i]`, where `q[i] = round(x[i] * (x_max / amax))` and
/// `scale = amax / x_max`. It comes from the vector itself, so no observation saturates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    scale: f32,
    /// 0 for a vector that counts as zero.
    inverse: f32,
}

impl Scale {
    /// Scale of integers that stay as they are.
    pub(crate) const ONE: Self = Self { scale: 1.0, inverse: 1.0 };

    /// Returns the scale of a vector whose largest magnitude has these bits, for integers in `-x_max ..= x_max`.
    /// Magnitudes compare as their bits; infinity's bits and all above are not finite.
    #[inline(always)]
    pub fn of_magnitude(bits: u32, x_max: u16) -> Result<Self, NotFinite> {
        if bits >= f32::INFINITY.to_bits() {
            return Err(NotFinite);
        }
        if bits < TINY.to_bits() {
            return Ok(Self { scale: 0.0, inverse: 0.0 });
        }
        let (amax, x_max) = (f32::from_bits(bits), f32::from(x_max));
        Ok(Self { scale: amax / x_max, inverse: x_max / amax })
    }

    /// Returns the factor from values to integers, before rounding.
    pub fn inverse(self) -> f32 {
        self.inverse
    }

    /// Returns the factor of the integers.
    pub fn get(self) -> f32 {
        self.scale
    }
}
