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

#[cfg(test)]
mod tests {
    use super::{Scale, TINY};
    use crate::math::real::Real as _;

    /// No larger value saturates, because products and rounding keep the order. All mantissas, and all exponents.
    #[test]
    fn the_largest_magnitude_becomes_the_largest_integer() {
        let mantissas = (0..1 << 23).map(|mantissa| 0x3f80_0000 | mantissa);
        let ends =
            (TINY.to_bits() >> 23..255).flat_map(|exponent| [0, 1, 0x40_0001, 0x7f_ffff].map(|m| exponent << 23 | m));
        for bits in mantissas.chain(ends) {
            for x_max in [1, 127, 2047, 32767] {
                let (x, scale) = (f32::from_bits(bits), Scale::of_magnitude(bits, x_max).expect("finite"));
                let found = [x, -x].map(|x| x.rounded(scale.inverse()) as i16);
                assert_eq!(found, [1, -1].map(|sign| sign * x_max as i16), "{bits:#x}");
            }
        }
    }

    #[test]
    fn every_tie_goes_to_the_even_integer() {
        for q in i16::MIN..i16::MAX {
            let tie = f32::from(q) + 0.5;
            let even = q + (q & 1);
            let found = [f32::from(q), tie.next_down(), tie, tie.next_up()].map(|x| x.rounded(1.0) as i16);
            assert_eq!(found, [q, q, even, q + 1]);
        }
    }
}
