//! Elementary functions in f32 by additions, multiplications and at most one division: no tables, no calls into a system
//! library, so the same bits on every machine. The error bounds are asserted over dense sweeps of the inputs, small and huge,
//! in the crate's tests; that each function takes at most 30 instructions per element on the Cortex-M4's FPU, by
//! `host-tests/tests/functions.rs`.
//!
//! | function | error bound, against the exact value |
//! |---|---|
//! | [`exp`] | 2.2e-7 * max(1, abs(x)) relative, for -21 < x < 21 |
//! | [`sigmoid`] | 1.1e-7 absolute |
//! | [`tanh`] | 1.5e-7 absolute |
//! | [`elu`] | 1.2e-7 absolute |
//! | [`silu`], [`gelu_tanh`] | 1.4e-7 * max(1, abs(x)) |
//! | [`gelu`] | 1.8e-7 * max(1, abs(x)) |
//!
//! Where the input is not a number, so is the result, except of [`relu`].

use crate::activations::ROUND;

/// The elementwise functions of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Function {
    /// `max(x, 0)`
    Relu = 0,
    /// `x` where positive, else `exp(x) - 1`
    Elu = 1,
    /// `x * sigmoid(x)`
    Silu = 2,
    /// `x * Phi(x)` with the exact normal distribution
    Gelu = 3,
    /// GELU by its tanh approximation, as torch's `approximate="tanh"`
    GeluTanh = 4,
    /// Hyperbolic tangent
    Tanh = 5,
    /// `1 / (1 + exp(-x))`
    Sigmoid = 6,
}

impl Function {
    /// All functions, in the order of their codes.
    pub const ALL: [Self; 7] =
        [Self::Relu, Self::Elu, Self::Silu, Self::Gelu, Self::GeluTanh, Self::Tanh, Self::Sigmoid];

    /// The function of a code in an image.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// The name, as in policy.json.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Relu => "relu",
            Self::Elu => "elu",
            Self::Silu => "silu",
            Self::Gelu => "gelu",
            Self::GeluTanh => "gelu_tanh",
            Self::Tanh => "tanh",
            Self::Sigmoid => "sigmoid",
        }
    }

    /// Applies the function to every element.
    pub fn apply(self, x: &mut [f32]) {
        match self {
            Self::Relu => each(x, relu),
            Self::Elu => each(x, elu),
            Self::Silu => each(x, silu),
            Self::Gelu => each_four(x, gelu),
            Self::GeluTanh => each(x, gelu_tanh),
            Self::Tanh => each(x, tanh),
            Self::Sigmoid => each(x, sigmoid),
        }
    }
}

/// One loop for each function, which is not inlined: the functions take most of the executor's code.
#[inline(never)]
fn each(x: &mut [f32], function: impl Fn(f32) -> f32) {
    for x in x {
        *x = function(*x);
    }
}

/// As [`each`], four in a pass, where the instructions of the loop count.
#[inline(never)]
fn each_four(x: &mut [f32], function: impl Fn(f32) -> f32) {
    let (fours, rest) = x.as_chunks_mut::<4>();
    for [a, b, c, d] in fours {
        *a = function(*a);
        *b = function(*b);
        *c = function(*c);
        *d = function(*d);
    }
    for x in rest {
        *x = function(*x);
    }
}

/// `x` limited to `low ..= high`; without the panic of `f32::clamp`.
#[inline(always)]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// The largest magnitude of an exponent of 2. Beyond, all functions here have come to their limits as far as f32 tells.
const MAX_EXPONENT: u32 = 32;

/// `2^y` as a fraction of two positive numbers, for a `y` limited to -32 ..= 31. What uses it has to divide anyway.
///
/// `y = n + f` with `|f| <= 1/2`. `2^f = (Q + f P) / (Q - f P)`, where `f P / Q` is `tanh(f ln 2 / 2)` with
/// `P = p0 + p1 f^2` and `Q = q0 + f^2`, fitted for the smallest relative error, 1e-10. `n` is added to the numerator's
/// exponent. The numbers are between 17 and 25, times `2^n` in the numerator.
#[inline(always)]
pub(crate) fn exp2(y: f32) -> (f32, f32) {
    let mut y = y;
    let mut shifted = y + ROUND;
    // As unsigned numbers, both ends in one comparison.
    if shifted.to_bits().wrapping_sub(ROUND.to_bits() - MAX_EXPONENT) >= 2 * MAX_EXPONENT {
        y = limit(y);
        shifted = y + ROUND;
    }
    let f = y - (shifted - ROUND);
    let square = f * f;
    let p = (0.057_690_073 * square + 7.215_289) * f;
    let q = square + 20.818_924;
    // The low bits of `shifted` are n; the product with 2^23 drops what stands above them.
    (f32::from_bits((q + p).to_bits().wrapping_add(shifted.to_bits() << 23)), q - p)
}

/// Rare, and so a call and not instructions in the way of every element.
#[cold]
#[inline(never)]
fn limit(y: f32) -> f32 {
    clamp(y, -(MAX_EXPONENT as f32), (MAX_EXPONENT - 1) as f32)
}

/// `e^x` as a fraction.
#[inline(always)]
pub(crate) fn exp_fraction(x: f32) -> (f32, f32) {
    exp2(x * core::f32::consts::LOG2_E)
}

/// `e^x`, for an `x` limited to -22.18 ..= 21.48.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let (n, d) = exp_fraction(x);
    n / d
}

/// `max(x, 0)`. By the bits, as an unsigned number: what is negative or not a number stands above infinity.
#[inline(always)]
pub fn relu(x: f32) -> f32 {
    let bits = x.to_bits();
    f32::from_bits(if bits > f32::INFINITY.to_bits() { 0 } else { bits })
}

/// `x` where positive, else `exp(x) - 1`
#[inline(always)]
pub fn elu(x: f32) -> f32 {
    if x > 0.0 {
        return x;
    }
    let (n, d) = exp_fraction(x);
    (n - d) / d
}

/// `1 / (1 + exp(-x))`
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    let (n, d) = exp_fraction(x);
    n / (n + d)
}

/// `(e - 1) / (e + 1)` with `e = exp(2 x)`
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let (n, d) = tanh_fraction(x);
    n / d
}

/// `tanh(x)` as a fraction.
#[inline(always)]
pub(crate) fn tanh_fraction(x: f32) -> (f32, f32) {
    let (n, d) = exp2(x * (2.0 * core::f32::consts::LOG2_E));
    (n - d, n + d)
}

/// `x * sigmoid(x)`
#[inline(always)]
pub fn silu(x: f32) -> f32 {
    x * sigmoid(x)
}

/// `max(x, 0) - a * tail(a)` with `a = |x|`, where `tail = 1 - Phi` is `p^8`, a power of a polynomial that was fitted for the
/// smallest error of `a * tail / max(1, a)`, 5e-8. From 5.5 on, `a * tail` is below 1.1e-7 and stays what it is there.
#[inline(always)]
pub fn gelu(x: f32) -> f32 {
    const END: f32 = 5.5;
    let a = f32::from_bits(x.to_bits() & 0x7fff_ffff);
    let a = if a > END { END } else { a };
    let p = 3.560_515e-6;
    let p = p * a - 3.936_551e-5;
    let p = p * a - 2.359_049_6e-5;
    let p = p * a + 1.594_202_8e-3;
    let p = p * a - 7.503_642_6e-4;
    let p = p * a - 3.189_156e-2;
    let p = p * a - 9.146_535e-2;
    let p = p * a + 0.917_004_6;
    let p = p * p;
    let p = p * p;
    // max(x, 0) without a comparison: zero where the sign bit is set.
    f32::from_bits(x.to_bits() & !((x.to_bits() as i32 >> 31) as u32)) - p * p * a
}

/// `x * sigmoid(2 u)` with `u = sqrt(2 / pi) (x + 0.044715 x^3)`, which is `x / 2 * (1 + tanh(u))`.
#[inline(always)]
pub fn gelu_tanh(x: f32) -> f32 {
    // The factors of x and x^3 in 2 u log2(e).
    let (n, d) = exp2(x * (2.302_208_2 + 0.102_943_24 * (x * x)));
    x * (n / (n + d))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(range: f64, f: fn(f32) -> f32, exact: impl Fn(f64) -> f64, scale: impl Fn(f64) -> f64) -> f64 {
        let n = 1 << 20;
        (0..=n)
            .map(|i| ((i as f64 / n as f64 * 2.0 - 1.0) * range) as f32)
            .map(|x| (f64::from(f(x)) - exact(f64::from(x))).abs() / scale(f64::from(x)))
            .fold(0.0, f64::max)
    }

    #[test]
    fn errors_stay_within_the_stated_bounds() {
        let sig = |x: f64| 1.0 / (1.0 + (-x).exp());
        let size = |x: f64| x.abs().max(1.0);
        let one = |_: f64| 1.0;
        // 2 sqrt(2 / pi)
        let u = |x: f64| 1.595_769_121_605_731 * (x + 0.044715 * x.powi(3));
        assert!(worst(21.0, exp, f64::exp, |x| x.exp() * size(x)) < 2.2e-7);
        // Near zero, where the functions bend, beyond their limits, and far beyond.
        for range in [1.0, 8.0, 40.0, 1e4, 1e30] {
            assert!(worst(range, sigmoid, sig, one) < 1.1e-7);
            assert!(worst(range, tanh, f64::tanh, one) < 1.5e-7);
            assert!(worst(range, elu, |x| if x > 0.0 { x } else { x.exp_m1() }, one) < 1.2e-7);
            assert!(worst(range, silu, |x| x * sig(x), size) < 1.4e-7);
            assert!(worst(range, gelu_tanh, |x| x * sig(u(x)), size) < 1.4e-7);
            // 0.5 erfc(-x / sqrt 2) by libm in f64, which is exact at this scale.
            assert!(worst(range, gelu, |x| x * 0.5 * libm::erfc(-x / 2f64.sqrt()), size) < 1.8e-7);
        }
    }

    /// Without the limit of the exponent, huge inputs would go wrong in many ways.
    #[test]
    fn every_magnitude_has_a_sensible_value() {
        for bits in (0..0x7f80_0000u32).step_by(4001) {
            let x = f32::from_bits(bits);
            for x in [x, -x] {
                let sign = if x > 0.0 { 1.0 } else { 0.0 };
                assert!((0.0..=1.0).contains(&sigmoid(x)) && (-1.0..=1.0).contains(&tanh(x)), "{x}");
                assert!(
                    x.abs() < 50.0 || (sigmoid(x) - sign).abs() < 1e-9 && (tanh(x) + 1.0 - 2.0 * sign) == 0.0,
                    "{x}"
                );
                for f in [elu, silu, gelu, gelu_tanh] {
                    assert!((f(x) - x * sign).abs() <= 1f32.max(1e-7 * x.abs()), "{x}");
                }
            }
        }
    }

    #[test]
    fn not_a_number_stays_so() {
        for f in [exp, elu, sigmoid, tanh, silu, gelu, gelu_tanh] {
            assert!(f(f32::NAN).is_nan() && f(-f32::NAN).is_nan());
        }
    }

    #[test]
    fn extremes_are_finite() {
        for x in [f32::MAX, f32::MIN, 1e-40, -0.0, 0.0] {
            for f in [exp, relu, elu, sigmoid, tanh, silu, gelu, gelu_tanh] {
                assert!(f(x).is_finite(), "{x}");
            }
        }
    }
}
