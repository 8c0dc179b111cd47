//! f32 arithmetic by integers, for cores without an FPU: the bits of IEEE 754, each operation rounded to nearest even.
//!
//! The operations take normal numbers and zeros. Subnormal numbers, infinities, NaN and results outside the range of
//! normal numbers are left to the compiler's own routines, which are slower. Between the roundings of an exponential
//! numbers stay in fixed point. There a product is not exact; if it is so near a tie that this could matter, the exact
//! way decides.
//!
//! A core is `NARROW` if its multiplication has 32 bits and it has no division (Armv6-M): there products are made of
//! halves, and a division is a reciprocal. The tests run both kinds on the host.

use core::ops::{Add, Div, Mul, Sub};

use super::exp2::{EXP, exp2_constants};
use super::functions::{Ratio, SIGMOID};
use super::real::Real;

/// An f32 as its bits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Soft<const NARROW: bool>(u32);

const SIGN: u32 = 1 << 31;
const INFINITY: u32 = 0xff << 23;
/// The leading bit of a mantissa.
const LEAD: u32 = 1 << 23;

/// The magnitude `mantissa * 2^(exponent - 150)` of a number that is not 0. The mantissa is in `LEAD ..= 2 * LEAD`, the
/// exponent that of the bits, if it is in their range.
#[derive(Clone, Copy)]
struct Magnitude {
    exponent: i32,
    mantissa: u32,
}

/// Rounds a number to nearest even, and drops its last `N` bits. The last bit may represent all that were dropped
/// before.
#[inline(always)]
fn rounded<const N: u32>(m: u32) -> u32 {
    (m + ((1 << (N - 1)) - 1) + (m >> N & 1)) >> N
}

/// Returns a number without its last bits; the new last one is set if any of them was.
#[inline(always)]
fn jammed(m: u32, bits: u32) -> u32 {
    m >> bits | u32::from(m << 1 << (31 - bits) != 0)
}

/// Moves the leading bit of `m`, which is not 0, up to bit `TOP`, and the exponent with it.
#[inline(always)]
fn normalized<const TOP: u32>(mut m: u32, mut exponent: i32) -> (u32, i32) {
    if cfg!(all(target_arch = "arm", not(actq_narrow))) {
        let zeros = m.leading_zeros();
        return (m << zeros >> (31 - TOP), exponent + (31 - TOP) as i32 - zeros as i32);
    }
    // The core cannot count zeros, and most often there are few.
    while m < 1 << (TOP - 7) {
        (m, exponent) = (m << 8, exponent - 8);
    }
    while m < 1 << TOP {
        (m, exponent) = (m << 1, exponent - 1);
    }
    (m, exponent)
}

/// Returns `true` for a number that is neither 0 nor subnormal, infinite or NaN.
#[inline(always)]
fn is_normal(bits: u32) -> bool {
    (bits << 1).wrapping_sub(1 << 24) < 254 << 24
}

#[inline(always)]
fn are_normal(a: u32, b: u32) -> bool {
    is_normal(a) && is_normal(b)
}

impl Magnitude {
    /// Returns the magnitude of a normal number.
    #[inline(always)]
    const fn of(bits: u32) -> Self {
        Self { exponent: (bits >> 23 & 0xff) as i32, mantissa: bits & (LEAD - 1) | LEAD }
    }

    #[inline(always)]
    fn is_normal(self) -> bool {
        (self.exponent as u32).wrapping_sub(1) < 254
    }

    /// Returns the bits of the number with this sign; `None` outside the range of normal numbers.
    #[inline(always)]
    fn bits(self, sign: u32) -> Option<u32> {
        self.is_normal().then(|| self.normal_bits(sign))
    }

    /// Returns the bits of a number that is normal. A mantissa of `2 * LEAD` adds 1 to the exponent.
    #[inline(always)]
    fn normal_bits(self, sign: u32) -> u32 {
        sign | (((self.exponent as u32 - 1) << 23) + self.mantissa)
    }

    /// Rounds `m * 2^(exponent - 156)`, for an m in `2^28 ..= 2^30`.
    #[inline(always)]
    fn of_30_bits(m: u32, exponent: i32) -> Self {
        // -1 below 2^29, otherwise 0.
        let small = (m as i32 - (1 << 29)) >> 31;
        Self { exponent: exponent + small, mantissa: rounded::<6>(m + (m & small as u32)) }
    }

    #[inline(always)]
    fn times<const NARROW: bool>(self, other: Self) -> Self {
        let m = if NARROW {
            let [(ah, al), (bh, bl)] = [self, other].map(|x| (x.mantissa >> 12, x.mantissa & 0xfff));
            let low = al * bl;
            let middle = ah * bl + al * bh + (low >> 12);
            (((ah * bh) << 6) + jammed(middle, 6)) | u32::from(low << 20 != 0)
        } else {
            let product = u64::from(self.mantissa << 7) * u64::from(other.mantissa << 7);
            (product >> 32) as u32 | u32::from(product as u32 != 0)
        };
        Self::of_30_bits(m, self.exponent + other.exponent - 126)
    }

    /// Adds a magnitude whose exponent is no larger.
    #[inline(always)]
    fn plus(self, small: Self) -> Self {
        let distance = (self.exponent - small.exponent) as u32;
        let small = if distance < 26 { jammed(small.mantissa << 5, distance) } else { 1 };
        let m = (self.mantissa << 5) + small;
        if m < 1 << 29 {
            Self { exponent: self.exponent, mantissa: rounded::<5>(m) }
        } else {
            Self { exponent: self.exponent + 1, mantissa: rounded::<6>(m) }
        }
    }

    /// Subtracts a magnitude that is no larger, nor its exponent; `None` for 0.
    #[inline(always)]
    fn minus(self, small: Self) -> Option<Self> {
        let distance = (self.exponent - small.exponent) as u32;
        let small = if distance < 26 { jammed(small.mantissa << 5, distance) } else { 1 };
        let m = (self.mantissa << 5) - small;
        if m == 0 {
            return None;
        }
        let (m, exponent) = normalized::<29>(m, self.exponent + 1);
        Some(Self { exponent, mantissa: rounded::<6>(m) })
    }

    #[inline(always)]
    fn over<const NARROW: bool>(self, divisor: Self) -> Self {
        let (n, d, exponent) = (self.mantissa, divisor.mantissa, self.exponent - divisor.exponent + 127);
        // The quotient is 1 and `rest / d`. No quotient is a tie: it would take 25 bits, and so would the dividend.
        let rest = n.wrapping_sub(d);
        let small = rest as i32 >> 31;
        let (rest, exponent) = (rest.wrapping_add(n & small as u32), exponent + small);
        let fraction = if NARROW { fraction_by_reciprocal(rest, d) } else { fraction_by_division(rest, d) };
        Self { exponent, mantissa: LEAD + ((fraction + 1) >> 1) }
    }
}

/// Returns `n / d` with 24 bits after the point, without rounding, for an n up to d.
#[inline(always)]
fn fraction_by_division(n: u32, d: u32) -> u32 {
    let (mut rest, mut quotient) = (n, 0);
    for _ in 0..3 {
        let digit = (rest << 8).checked_div(d).unwrap_or(0);
        rest = (rest << 8).wrapping_sub(digit * d);
        quotient = quotient << 8 | digit;
    }
    quotient
}

/// 2^11 over the numbers from 8 to 15, each half a unit larger, rounded down. The first is for 16.
const RECIPROCALS: [u8; 16] = {
    let mut all = [0; 16];
    let mut i = 8;
    while i < 16 {
        all[i] = ((1 << 12) / (2 * i + 1)) as u8;
        i += 1;
    }
    all[0] = 124;
    all
};

/// Computes [`fraction_by_division`] by products of 32 bits: two digits of 12 bits.
#[inline(always)]
fn fraction_by_reciprocal(n: u32, d: u32) -> u32 {
    // 2^30 over the first 15 bits, which are rounded up: an estimate of 4 bits and two steps of Newton's, from below.
    let top = (d >> 9) + 1;
    let estimate = u32::from(RECIPROCALS[(top >> 11) as usize % 16]);
    let estimate = (estimate * ((1 << 23) - top * estimate)) >> 14;
    let reciprocal = (estimate * (((1 << 31) - top * estimate) >> 15)) >> 15;
    // No digit is too large, and the second one is too small by at most 3.
    let first = ((n >> 9) * reciprocal) >> 18;
    let rest = (n << 12).wrapping_sub(first * d);
    let second = ((rest >> 11) * reciprocal) >> 16;
    let mut rest = (rest << 12).wrapping_sub(second * d);
    let mut quotient = (first << 12) + second;
    for _ in 0..3 {
        // No branch.
        let more = !((rest.wrapping_sub(d) as i32 >> 31) as u32);
        rest = rest.wrapping_sub(d & more);
        quotient = quotient.wrapping_sub(more);
    }
    quotient
}

/// Returns the high word of a product. With a narrow multiplication, up to 3 may be missing.
#[inline(always)]
fn high<const NARROW: bool>(a: u32, b: u32) -> u32 {
    if NARROW {
        let [(ah, al), (bh, bl)] = [a, b].map(|x| (x >> 16, x & 0xffff));
        ah * bh + ((ah * bl) >> 16) + ((al * bh) >> 16)
    } else {
        ((u64::from(a) * u64::from(b)) >> 32) as u32
    }
}

/// Returns `true` if the last `N` bits are within `distance` of a tie.
#[inline(always)]
fn is_near_tie<const N: u32>(m: u32, distance: u32) -> bool {
    (m << (32 - N)).wrapping_sub((1 << 31) - (distance << (32 - N))) <= (2 * distance) << (32 - N)
}

/// Magnitudes of `exp2_constants`: p1, p0 and q0 in units.
const P: [Magnitude; 3] = {
    let [_, p1, p0, q0] = exp2_constants(1.0);
    [Magnitude::of(p1.to_bits()), Magnitude::of(p0.to_bits()), Magnitude::of(q0.to_bits())]
};

/// Computes `math::exp2::fraction` for an f that is not negative, as mantissas of its two numbers, which both have the
/// exponent of q0. f is in units of 2^-32, at most a half; `exact` is all of it, with its exponent in units.
#[inline(always)]
fn fraction<const NARROW: bool>(f: u32, exact: impl Fn() -> Magnitude) -> (u32, u32) {
    let missing = if NARROW { 3 } else { 0 };
    let [p1, p0, q0] = P;
    // f^2 with 32 bits after the point. Its last bit in f32 is 2^-26 at most.
    let square = high::<NARROW>(f, f);
    // p1 f^2 with 36 bits after the point; p0 has 21, q0 has 19.
    let product = high::<NARROW>(square, p1.mantissa << 8);
    if is_near_tie::<13>(square, 34 + missing) || is_near_tie::<15>(product, 68 + 2 * missing) {
        return fraction_near_tie::<NARROW>(exact());
    }
    let q = q0.mantissa + ((square + (1 << 12)) >> 13);
    let p = p0.mantissa + ((product + (1 << 14)) >> 15);
    // f P with 29 bits after the point. Its last bit in f32 is 2^-22 at most.
    let product = high::<NARROW>(f, p << 8);
    if is_near_tie::<10>(product, 66 + missing) {
        // In f32 the product is the tie if it is within half of its last bit. A sum that is a tie becomes even.
        let distance = (product & 0x3ff).abs_diff(1 << 9);
        let last = (1 << 31 >> product.leading_zeros()) >> 24;
        if distance.abs_diff(last) <= 2 + missing || last == 0 {
            return fraction_near_tie::<NARROW>(exact());
        }
        if distance < last {
            let p = product >> 10;
            return ((q + p + 1) & !1, (q - p) & !1);
        }
    }
    let p = (product + (1 << 9)) >> 10;
    (q + p, q - p)
}

#[cold]
#[inline(never)]
fn fraction_near_tie<const NARROW: bool>(f: Magnitude) -> (u32, u32) {
    let [p1, p0, q0] = P;
    let square = f.times::<NARROW>(f);
    let p = p0.plus(p1.times::<NARROW>(square)).times::<NARROW>(f);
    let q = q0.plus(square);
    (q.plus(p).mantissa, q.minus(p).map_or(0, |d| d.mantissa))
}

/// Computes what is outside the range of normal numbers, in the compiler's way. There is one for each `of`: a call through
/// a pointer would leave the stack without a bound.
#[cold]
#[inline(never)]
fn slow(a: u32, b: u32, of: impl Fn(f32, f32) -> f32) -> u32 {
    of(f32::from_bits(a), f32::from_bits(b)).to_bits()
}

#[inline(never)]
fn sum(a: u32, b: u32) -> u32 {
    let (large, small) = if a << 1 < b << 1 { (b, a) } else { (a, b) };
    let add = || {
        let [l, s] = [large, small].map(Magnitude::of);
        if (a ^ b) & SIGN == 0 {
            return l.plus(s).bits(large & SIGN);
        }
        match l.minus(s) {
            Some(difference) => difference.bits(large & SIGN),
            None => Some(0),
        }
    };
    let special = || match small << 1 {
        0 if large << 1 == 0 => Some(a & b),
        0 if is_normal(large) => Some(large),
        _ => None,
    };
    let result = if is_normal(small) && large << 1 < INFINITY << 1 { add() } else { special() };
    result.unwrap_or_else(|| slow(a, b, |a, b| a + b))
}

#[inline(always)]
fn difference(a: u32, b: u32) -> u32 {
    sum(a, b ^ SIGN)
}

#[inline(never)]
fn product<const NARROW: bool>(a: u32, b: u32) -> u32 {
    if are_normal(a, b)
        && let Some(bits) = Magnitude::of(a).times::<NARROW>(Magnitude::of(b)).bits((a ^ b) & SIGN)
    {
        return bits;
    }
    let is_finite = |bits: u32| bits & !SIGN < INFINITY;
    if a << 1 == 0 && is_finite(b) || b << 1 == 0 && is_finite(a) {
        return (a ^ b) & SIGN;
    }
    slow(a, b, |a, b| a * b)
}

#[inline(never)]
fn quotient<const NARROW: bool>(a: u32, b: u32) -> u32 {
    if are_normal(a, b)
        && let Some(bits) = Magnitude::of(a).over::<NARROW>(Magnitude::of(b)).bits((a ^ b) & SIGN)
    {
        return bits;
    }
    slow(a, b, |a, b| a / b)
}

#[cold]
#[inline(never)]
fn slow_rounded(x: u32, factor: f32) -> u32 {
    f32::from_bits(x).rounded(factor)
}

#[cold]
#[inline(never)]
fn slow_scaled(mut start: f32, sum: i32, scale: f32, x_scale: f32) -> f32 {
    f32::add_scaled(&mut start, sum, scale, x_scale);
    start
}

/// Returns the high word of a product of numbers whose last 8 bits are zeros; its last bit is set if any of the low word
/// is.
#[inline(always)]
fn high_jammed<const NARROW: bool>(a: u32, b: u32) -> u32 {
    if NARROW {
        let [(ah, al), (bh, bl)] = [a, b].map(|x| (x >> 20, x >> 8 & 0xfff));
        let low = al * bl;
        let middle = ah * bl + al * bh + (low >> 12);
        return (((ah * bh) << 8) + jammed(middle, 4)) | u32::from(low << 20 != 0);
    }
    let product = u64::from(a) * u64::from(b);
    (product >> 32) as u32 | u32::from(product as u32 != 0)
}

/// Moves the leading bit of a number that has no other bits above bit 23 to bit 31, and returns the distance, too.
#[inline(always)]
fn to_the_top(mut m: u32) -> (u32, u32) {
    if cfg!(all(target_arch = "arm", not(actq_narrow))) {
        return (m << (m.leading_zeros() & 31), m.leading_zeros());
    }
    // The core cannot count zeros.
    let mut zeros = 0;
    for step in [16, 8, 4, 2, 1] {
        if m >> (32 - step) == 0 {
            (m, zeros) = (m << step, zeros + step);
        }
    }
    (m, zeros)
}

/// Returns a number of 31 or 32 bits with its leading bit at bit 31, and 1 if it was there.
#[inline(always)]
fn one_up(m: u32) -> (u32, u32) {
    let is_there = m >> 31;
    (m << (1 - is_there), is_there)
}

/// Rounds to nearest even, and sets the last 8 bits to zeros; `None` for a result of 33 bits.
#[inline(always)]
fn rounded_in_place(m: u32) -> Option<u32> {
    Some(m.checked_add(0x7f + (m >> 8 & 1))? & !0xff)
}

/// Returns `true` for a positive number from 2^-47 on and below 2^48. No product of a sum below 2^24 with two of them leaves
/// the range of normal numbers.
pub(crate) const fn is_usual(bits: u32) -> bool {
    bits.wrapping_sub(80 << 23) < 95 << 23
}

/// Computes [`Real::add_scaled`] for usual numbers: a sum below 2^24, which f32 represents exactly, scales that
/// [`is_usual`] accepts, and a start that is 0 or at most 30 binary places from the term. Otherwise, and very rarely for
/// them, it returns `None`.
///
/// Mantissas have their leading bit at bit 31.
#[inline(always)]
fn scaled<const NARROW: bool>(start: u32, sum: i32, scale: u32, x_scale: u32) -> Option<u32> {
    let magnitude = sum.unsigned_abs();
    if !is_usual(scale) || !is_usual(x_scale) || magnitude >> 24 != 0 {
        return None;
    }
    if magnitude == 0 {
        // Only a sum of two negative zeros is negative.
        return (start == 0 || is_normal(start)).then_some(start);
    }
    // A bf16 has 8 bits: one word holds the product.
    let (factor, carry) = one_up((scale >> 16 & 0x7f | 0x80) * (x_scale & (LEAD - 1) | LEAD));
    let (sum_up, zeros) = to_the_top(magnitude);
    let (term, term_carry) = one_up(high_jammed::<NARROW>(sum_up, rounded_in_place(factor)?));
    let term = rounded_in_place(term)?;
    let exponent = ((scale >> 23) + (x_scale >> 23) + carry + term_carry) as i32 - zeros as i32 - 96;
    if start << 1 == 0 {
        return Some(sum as u32 & SIGN | (((exponent as u32 - 1) << 23) + (term >> 8)));
    }
    // The sum's leading bit is 24 places below the smaller number's at least.
    if (start << 1).wrapping_sub(30 << 24) >= 221 << 24 {
        return None;
    }
    let signed = |m: u32, sign: i32| ((m >> 2) as i32 ^ sign >> 31).wrapping_sub(sign >> 31);
    let (term, start_exponent) = (signed(term, sum), (start >> 23 & 0xff) as i32);
    let start = signed(start << 8 | 1 << 31, start as i32);
    let distance = exponent - start_exponent;
    let (large, small, exponent, distance) = if distance >= 0 {
        (term, start, exponent, distance as u32)
    } else {
        (start, term, start_exponent, distance.unsigned_abs())
    };
    if distance > 30 {
        return None;
    }
    let result = large + (small >> distance | i32::from(small << 1 << (31 - distance) != 0));
    if result == 0 {
        return Some(0);
    }
    let (m, exponent) = normalized::<30>(result.unsigned_abs(), exponent + 1);
    Some(result as u32 & SIGN | (((exponent as u32 - 1) << 23) + rounded::<7>(m)))
}

impl<const NARROW: bool> Add for Soft<NARROW> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(sum(self.0, other.0))
    }
}

impl<const NARROW: bool> Sub for Soft<NARROW> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(difference(self.0, other.0))
    }
}

impl<const NARROW: bool> Mul for Soft<NARROW> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(product::<NARROW>(self.0, other.0))
    }
}

impl<const NARROW: bool> Div for Soft<NARROW> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(quotient::<NARROW>(self.0, other.0))
    }
}

/// The power `2^|y| = large / small * 2^whole`; both mantissas have the exponent of q0.
struct Power {
    large: u32,
    small: u32,
    whole: i32,
}

impl Power {
    /// Computes `math::exp2::exp2` for the magnitude y, in units; `None` for 31.5 and more, and halfway between two whole
    /// numbers.
    #[inline(always)]
    fn of<const NARROW: bool>(y: Magnitude) -> Option<Self> {
        // 32 bits after the point, and what is before it.
        let shift = y.exponent - 118;
        let (f, whole) = match shift {
            0..14 => (y.mantissa << shift, y.mantissa >> 1 >> (31 - shift)),
            14.. => return None,
            -31..0 => (y.mantissa >> -shift, 0),
            _ => (0, 0),
        };
        let (up, whole) = ((f as i32 >> 31) as u32, (whole + (f >> 31)) as i32);
        if f == 1 << 31 || whole > 31 {
            return None;
        }
        let f = (f ^ up).wrapping_sub(up);
        let (large, small) = fraction::<NARROW>(f, || match shift {
            0.. => Magnitude { exponent: 126 - f.leading_zeros() as i32, mantissa: f << f.leading_zeros() >> 8 },
            _ => y,
        });
        let swap = (large ^ small) & up;
        Some(Self { large: large ^ swap, small: small ^ swap, whole })
    }

    /// Computes `2^|factor x|`, in quarters.
    #[inline(always)]
    fn of_product<const NARROW: bool>(x: u32, factor: f32) -> Option<Self> {
        let y = Magnitude::of(x).times::<NARROW>(Magnitude::of(factor.to_bits()));
        Self::of::<NARROW>(Magnitude { exponent: y.exponent + 2, ..y })
    }

    /// Returns the larger number, with this exponent, and the smaller one.
    #[inline(always)]
    fn numbers(&self, exponent: i32) -> (Magnitude, Magnitude) {
        let small = Magnitude { exponent: exponent - self.whole, mantissa: self.small };
        (Magnitude { exponent, mantissa: self.large }, small)
    }
}

/// Computes [`Real::gate`]; `None` for large values. All exponents are between 20 and 200.
#[inline(never)]
fn gate<const NARROW: bool>(gate: u32, x: u32) -> Option<u32> {
    let (on, off) = Power::of_product::<NARROW>(gate, EXP)?.numbers(127);
    let (n, d) = Power::of_product::<NARROW>(x, 2.0 * EXP)?.numbers(127);
    let Some(difference) = n.minus(d) else { return Some(0) };
    let below = on.plus(off).times::<NARROW>(n.plus(d));
    let above = (if gate >> 31 == 0 { on } else { off }).times::<NARROW>(difference);
    Some(above.over::<NARROW>(below).normal_bits(x & SIGN))
}

#[inline(never)]
fn exponential<const NARROW: bool>(y: u32, one: f32) -> (u32, u32) {
    let unit = Magnitude::of(one.to_bits()).exponent - 127;
    let exact = Magnitude { exponent: Magnitude::of(y).exponent - unit, ..Magnitude::of(y) };
    let Some(power) = Power::of::<NARROW>(exact) else {
        let (n, d) = f32::from_bits(y).power(one);
        return (n.to_bits(), d.to_bits());
    };
    // Both numbers are normal: `one` is between 2^-2 and 2^26, and `one^2` a factor of them.
    let exponent = ((P[2].exponent + 2 * unit - 1) as u32) << 23;
    let whole = (power.whole as u32) << 23;
    if y >> 31 == 0 {
        (exponent + power.large + whole, exponent + power.small)
    } else {
        (exponent + power.small - whole, exponent + power.large)
    }
}

impl<const NARROW: bool> Real for Soft<NARROW> {
    #[inline(always)]
    fn of(x: f32) -> Self {
        Self(x.to_bits())
    }

    #[inline(always)]
    fn get(self) -> f32 {
        f32::from_bits(self.0)
    }

    #[inline(always)]
    fn is_above(self, end: f32) -> bool {
        let (bits, end) = (self.0 as i32, end.to_bits() as i32);
        bits > end && bits <= INFINITY as i32
    }

    #[inline(always)]
    fn truncated(self) -> Self {
        // Numbers from 2^31 on are limited to it, and those from 2^23 on are whole.
        match self.0 >> 23 & 0xff {
            0..127 => Self(0),
            exponent @ 127..150 => {
                Self(self.0 & (SIGN | INFINITY | (LEAD - 1) << (150 - exponent)) & !((1 << (150 - exponent)) - 1))
            }
            150..158 => self,
            255 if self.0 << 9 != 0 => Self(0),
            158.. => Self(self.0 & SIGN | 158 << 23),
        }
    }

    #[inline(always)]
    fn power(self, one: f32) -> (Self, Self) {
        let (n, d) = exponential::<NARROW>(self.0, one);
        (Self(n), Self(d))
    }

    #[inline(always)]
    fn ratio(self, ratio: &Ratio) -> Self {
        let Some(power) = Power::of_product::<NARROW>(self.0, ratio.factor) else {
            return Self::of(self.get().ratio(ratio));
        };
        // For a positive x, the larger number is n. All exponents are between 90 and 130.
        let (large, small) = power.numbers(127);
        // ELU takes no positive x.
        let below = if ratio.b.to_bits() == 0 { large } else { large.plus(small) };
        let (above, sign) = if ratio.a.to_bits() == 0 {
            (if self.0 >> 31 == 0 { large } else { small }, 0)
        } else if let Some(difference) = large.minus(small) {
            (difference, self.0 & SIGN)
        } else {
            return Self(0);
        };
        Self(above.over::<NARROW>(below).normal_bits(sign))
    }

    #[inline(always)]
    fn sigmoid(self) -> Self {
        self.ratio(&SIGMOID)
    }

    #[inline(always)]
    fn gate(self, x: Self) -> Self {
        gate::<NARROW>(self.0, x.0).map_or_else(|| Self(slow(self.0, x.0, |gate, x| gate.gate(x))), Self)
    }

    #[inline(always)]
    fn rounded(self, factor: f32) -> u32 {
        let by = Magnitude::of(factor.to_bits());
        let x = Magnitude::of(self.0);
        // The product is `m / 2^point`.
        let point = 283 - x.exponent - by.exponent;
        if point > 31 {
            return 0;
        }
        let fast = |m: u32, missing: u32| {
            let half = m + (1 << point >> 1);
            let (near, mask) = (66 + missing, (1 << point) - 1);
            let is_near = half.wrapping_add(near) & mask < 2 * near;
            let magnitude = (half >> point) as i32;
            (!is_near).then_some((if self.0 >> 31 == 0 { magnitude } else { -magnitude }) as u32)
        };
        let (a, b) = (x.mantissa << 8, by.mantissa << 8);
        let is_in_range = (10..32).contains(&point) && factor.to_bits().wrapping_sub(LEAD) < INFINITY - LEAD;
        let coarse = || if NARROW { fast(((a >> 16) * (b >> 16)) >> 1, 1 << 16) } else { None };
        is_in_range
            .then(|| coarse().or_else(|| fast(high::<NARROW>(a, b) >> 1, 2)))
            .flatten()
            .unwrap_or_else(|| slow_rounded(self.0, factor))
    }

    #[inline(always)]
    fn add_scaled(y: &mut f32, sum: i32, scale: f32, x_scale: f32) {
        let scaled = scaled::<NARROW>(y.to_bits(), sum, scale.to_bits(), x_scale.to_bits());
        *y = scaled.map_or_else(|| slow_scaled(*y, sum, scale, x_scale), f32::from_bits);
    }
}

#[cfg(all(test, feature = "writer"))]
mod tests {
    use super::*;
    use crate::activations::TINY;
    use crate::math::exp2::{FIXED_ONE, QUARTER};
    use crate::math::{cos, elu, exp, gelu, gelu_tanh, mish, sigmoid, silu, sin, softplus, tanh};

    /// Bits at the ends of all ranges.
    const EDGES: [u32; 22] = [
        0,
        1,
        LEAD - 1,
        LEAD,
        LEAD + 1,
        2 * LEAD - 1,
        2 * LEAD,
        0x33ff_ffff,
        0x3400_0000,
        0x3eff_ffff,
        0x3f00_0000,
        0x3f7f_ffff,
        0x3f80_0000,
        0x3f80_0001,
        0x3fff_ffff,
        0x4afe_ffff,
        0x4b00_0000,
        0x7f00_0000,
        0x7f7f_ffff,
        INFINITY,
        INFINITY + 1,
        0x7fff_ffff,
    ];

    fn random(seed: u32) -> impl FnMut() -> u32 {
        let mut seed = seed;
        move || {
            seed ^= seed << 13;
            seed ^= seed >> 17;
            seed ^= seed << 5;
            seed
        }
    }

    #[track_caller]
    fn assert_same(found: f32, expected: f32, case: impl core::fmt::Debug) {
        let same = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
        assert!(same, "{found:?} ({:08x}), not {expected:?}: {case:x?}", found.to_bits());
    }

    /// Calls `check` with pairs of numbers: edges, any bits, and numbers of like magnitude, whose sums cancel.
    fn pairs(mut check: impl FnMut(u32, u32)) {
        let edges = EDGES.iter().flat_map(|bits| [*bits, bits | SIGN]);
        for a in edges.clone() {
            edges.clone().for_each(|b| check(a, b));
        }
        let mut random = random(1);
        for _ in 0..1 << 20 {
            let (a, b, near) = (random(), random(), random());
            check(a, b);
            check(a, a ^ (b >> (near % 32)) ^ (near & SIGN));
            // Few bits are set: ties, powers of two.
            check(a & (random() << (near % 24)), b & (random() << (near / 32 % 24)));
        }
    }

    fn operations_are_exact<const NARROW: bool>() {
        pairs(|a, b| {
            let [x, y] = [a, b].map(f32::from_bits);
            let [s, t] = [a, b].map(Soft::<NARROW>);
            assert_same((s + t).get(), x + y, ("+", a, b));
            assert_same((s - t).get(), x - y, ("-", a, b));
            assert_same((s * t).get(), x * y, ("*", a, b));
            assert_same((s / t).get(), x / y, ("/", a, b));
        });
    }

    #[test]
    fn operations_have_the_bits_of_f32() {
        operations_are_exact::<false>();
        operations_are_exact::<true>();
    }

    /// Calls `check` with every `step`th f32 and with all edges.
    fn numbers(step: usize, check: impl Fn(f32)) {
        EDGES.iter().flat_map(|bits| [*bits, bits | SIGN]).for_each(|bits| check(f32::from_bits(bits)));
        (0..=u32::MAX).step_by(step).for_each(|bits| check(f32::from_bits(bits)));
    }

    fn functions_are_exact<const NARROW: bool>(step: usize) {
        macro_rules! check {
            ($($function:ident)*) => {
                $(numbers(step, |x| assert_same($function(Soft::<NARROW>::of(x)).get(), $function(x), (stringify!($function), x.to_bits())));)*
            };
        }
        check!(elu tanh sigmoid silu exp gelu gelu_tanh softplus mish sin cos);
        for one in [QUARTER, FIXED_ONE] {
            numbers(step, |x| {
                let (found, expected) = (Soft::<NARROW>::of(x).power(one), x.power(one));
                assert_same(found.0.get(), expected.0, ("n", x.to_bits()));
                assert_same(found.1.get(), expected.1, ("d", x.to_bits()));
            });
        }
        numbers(step, |x| {
            let s = Soft::<NARROW>::of(x);
            assert_same(s.truncated().get(), x.truncated(), x.to_bits());
            for end in [0.0, 2.75, f32::INFINITY] {
                assert_eq!(s.is_above(end), x > end, "{x}");
            }
        });
    }

    #[test]
    fn functions_have_the_bits_of_f32() {
        functions_are_exact::<false>(2003);
        functions_are_exact::<true>(2017);
    }

    /// Rounds values of a vector with this largest magnitude, as a product does. Half of them are near a tie.
    fn rounding_is_exact<const NARROW: bool>() {
        let mut random = random(2);
        for _ in 0..1 << 20 {
            let largest = f32::from_bits((random() % (0x7f80_0000 - TINY.to_bits())) + TINY.to_bits());
            let x_max = [127.0, 2047.0, 32767.0][random() as usize % 3];
            let factor = x_max / largest;
            let magnitude = match random() % 4 {
                0 => f32::from_bits(random() % (largest.to_bits() + 1)),
                1 => f32::from_bits(largest.to_bits() - (random() >> (random() % 32)).min(largest.to_bits())),
                _ => ((random() % x_max as u32) as f32 + 0.5) / factor,
            };
            let x = f32::from_bits((magnitude.to_bits() + random() % 5).saturating_sub(2).min(largest.to_bits()));
            for x in [x, -x, 0.0 * x] {
                let (found, expected) = (Soft::<NARROW>::of(x).rounded(factor), x.rounded(factor));
                assert_eq!(found as u16, expected as u16, "{x:?} times {factor:?}");
            }
        }
        assert_eq!(Soft::<NARROW>::of(1e-33).rounded(0.0), 0);
    }

    #[test]
    fn activations_have_the_bits_of_f32() {
        rounding_is_exact::<false>();
        rounding_is_exact::<true>();
    }

    fn scaling_is_exact<const NARROW: bool>() {
        let mut random = random(3);
        for _ in 0..1 << 20 {
            let sum = random() as i32 >> (random() % 32);
            let [scale, x_scale] =
                [0x3c00_0000, 0x3c00_0000].map(|one| f32::from_bits(one + (random() >> (random() % 12 + 3))));
            let scale = f32::from_bits(scale.to_bits() & 0xffff_0000 | random() & SIGN);
            let term = sum as f32 * (scale * x_scale);
            let start = match random() % 4 {
                0 => f32::from_bits(random()),
                1 => f32::from_bits(random() & SIGN),
                _ => f32::from_bits(term.to_bits() ^ SIGN ^ (random() >> (random() % 32))),
            };
            let (mut found, mut expected) = (start, start);
            Soft::<NARROW>::add_scaled(&mut found, sum, scale, x_scale);
            f32::add_scaled(&mut expected, sum, scale, x_scale);
            assert_same(found, expected, (start.to_bits(), sum, scale, x_scale));
        }
        // Outside the range of normal numbers.
        pairs(|a, b| {
            let (start, scale) = (f32::from_bits(a), f32::from_bits(b & 0xffff_0000));
            let (sum, x_scale) = ((a ^ b) as i32 >> 9, f32::from_bits(b.rotate_left(16) & !SIGN));
            let (mut found, mut expected) = (start, start);
            Soft::<NARROW>::add_scaled(&mut found, sum, scale, x_scale);
            f32::add_scaled(&mut expected, sum, scale, x_scale);
            assert_same(found, expected, (a, b));
        });
    }

    #[test]
    fn scaled_sums_have_the_bits_of_f32() {
        scaling_is_exact::<false>();
        scaling_is_exact::<true>();
    }

    /// Adds all sums of 16 bits, and those around each power of two, times every mantissa of a row scale.
    fn scaling_of_every_sum_is_exact<const NARROW: bool>() {
        let powers = (15..32).flat_map(|k| [-1, 0, 1].map(|d| (1i32 << k).wrapping_add(d)));
        for sum in (-0x8000..=0x7fff).chain(powers.clone()).chain(powers.map(i32::wrapping_neg)) {
            for mantissa in 0..0x80 {
                let scale = f32::from_bits(0x3c00_0000 | mantissa << 16);
                let (mut found, mut expected) = (-1.5, -1.5);
                Soft::<NARROW>::add_scaled(&mut found, sum, scale, 0.012_345);
                f32::add_scaled(&mut expected, sum, scale, 0.012_345);
                assert_same(found, expected, (sum, scale));
            }
        }
    }

    #[test]
    fn every_sum_of_16_bits_has_the_bits_of_f32() {
        scaling_of_every_sum_is_exact::<false>();
        scaling_of_every_sum_is_exact::<true>();
    }

    fn gates_are_exact<const NARROW: bool>() {
        pairs(|a, b| {
            let [gate, x] = [a, b].map(f32::from_bits);
            assert_same(Soft::<NARROW>::of(gate).gate(Soft::of(x)).get(), gate.gate(x), (a, b));
            // The usual magnitudes: 2^-15 to 2^5.
            let [gate, x] =
                [a, b].map(|bits| f32::from_bits(bits & (SIGN | (LEAD - 1)) | (112 + (bits >> 23 & 0xff) % 20) << 23));
            assert_same(Soft::<NARROW>::of(gate).gate(Soft::of(x)).get(), gate.gate(x), (gate, x));
        });
    }

    #[test]
    fn gates_have_the_bits_of_f32() {
        gates_are_exact::<false>();
        gates_are_exact::<true>();
    }

    #[test]
    #[ignore = "takes minutes: all numbers"]
    fn functions_have_the_bits_of_f32_for_all_numbers() {
        functions_are_exact::<false>(1);
        functions_are_exact::<true>(1);
    }
}
