//! Powers of two and exponentials, as fractions.

use super::real::Real;
use crate::round::ROUND;

/// Computes `2^(y / one)` as a fraction of two positive numbers, for a finite y. `one` is a power of two: it sets the
/// unit and changes nothing else. The exponent stays within -33 ..= 33; there, all functions of this module have
/// reached their limits in f32. The callers divide anyway.
///
/// In units, `y = n + f` with `|f| <= 1/2`. `2^f = (Q + f P) / (Q - f P)`, where `f P / Q` is `tanh(f ln 2 / 2)` with
/// `P = p0 + p1 f^2` and `Q = q0 + f^2`, fitted for the smallest relative error, 1e-10. The numerator is multiplied by
/// `2^n`. The numbers are between 17 and 25 times `one^2`, and times `2^n` in the numerator.
#[inline(always)]
pub(super) fn exp2(y: f32, one: f32) -> (f32, f32) {
    let [round, ..] = exp2_constants(one);
    let whole = (y + round) - round;
    let (n, d) = fraction(y - whole, one);
    let is_x86 = cfg!(any(target_arch = "x86", target_arch = "x86_64"));
    (n * power(if is_x86 { by_comparison(whole, one) } else { by_conversion(whole, one) }), d)
}

/// Returns a whole number of units at the bits of an exponent. With 26 bits after the point, 6 remain for the whole
/// part: the conversion limits it.
#[inline(always)]
fn by_conversion(whole: f32, one: f32) -> i32 {
    (whole * (FIXED_ONE / one)) as i32 >> (26 - EXPONENT)
}

/// Computes [`by_conversion`] for x86, whose vector instructions have no conversion that limits.
#[inline(always)]
fn by_comparison(whole: f32, one: f32) -> i32 {
    const END: f32 = 32.0;
    let n = whole * (1.0 / one);
    let n = if n < -END { -END } else { n };
    let n = if n > END { END } else { n };
    // The sum's last bits are the whole number. The conversion ends just below 32.
    ((n + ROUND).to_bits() << EXPONENT) as i32 - i32::from(n == END)
}

/// Computes `2^(f / one)` as in [`exp2`], for `|f| <= one / 2`.
#[inline(always)]
pub(super) fn fraction<R: Real>(f: R, one: f32) -> (R, R) {
    let [_, p1, p0, q0] = exp2_constants(one).map(R::of);
    let square = f * f;
    let p = (p1 * square + p0) * f;
    let q = square + q0;
    (q + p, q - p)
}

/// Returns a power of two from its exponent, at the bits of an f32's exponent with zeros below.
#[inline(always)]
pub(super) fn power(exponent: i32) -> f32 {
    f32::from_bits((1.0f32.to_bits() as i32).wrapping_add(exponent) as u32)
}

/// First bit of the exponent of an f32.
pub(super) const EXPONENT: u32 = f32::MANTISSA_DIGITS - 1;

/// Returns the number that rounds in these units, p1, p0 and q0.
pub(crate) const fn exp2_constants(one: f32) -> [f32; 4] {
    // 2 more than 1.5 * 2^23, which could be half a unit in the last place of a large y: then the sum would be a tie,
    // and f not small. (A large positive y whose sum needs another bit has a large f, but then the denominator is
    // negligible against the numerator.)
    let round = (ROUND + 2.0) * one;
    [round, 0.057_690_073 / one, 7.215_289 * one, 20.818_924 * one * one]
}

/// 1 with 26 bits after the point.
pub(super) const FIXED_ONE: f32 = (1 << 26) as f32;

/// Unit of a quarter for exponents: no product of an f32 and their factor overflows.
pub(crate) const QUARTER: f32 = 0.25;

/// Factor of x in the exponent of `e^x`, in quarters.
pub(crate) const EXP: f32 = core::f32::consts::LOG2_E * QUARTER;

/// Computes `e^x` as a fraction.
#[inline(always)]
pub(crate) fn exp_fraction<R: Real>(x: R) -> (R, R) {
    (x * R::of(EXP)).power(QUARTER)
}

/// Computes `tanh(x)` as a fraction.
#[inline(always)]
#[cfg_attr(actq_fpu, allow(dead_code, reason = "with an FPU, cells are in assembler"))]
pub(crate) fn tanh_fraction<R: Real>(x: R) -> (R, R) {
    let (n, d) = (x * R::of(2.0 * EXP)).power(QUARTER);
    (n - d, n + d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_equal_in_both_ways() {
        for one in [QUARTER, 1.0, FIXED_ONE] {
            let wholes = (-1000..=1000).map(|n| n as f32);
            let large =
                (0..0x7f80_0000u32).step_by(4001).map(|bits| f32::from_bits(bits).round()).flat_map(|x| [x, -x]);
            for whole in wholes.chain(large) {
                let whole = whole * one;
                assert_eq!(by_conversion(whole, one), by_comparison(whole, one), "{whole} {one}");
            }
        }
    }
}
