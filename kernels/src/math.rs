//! Elementary functions in f32 by additions, multiplications and one division: no tables, no calls into a system library, so
//! the same bits on every machine. The error bounds are asserted over a dense sweep of the inputs in the crate's tests.
//!
//! | function | error bound, against the exact value |
//! |---|---|
//! | [`exp`] | 1.5e-7 relative, for -87 < x < 88 |
//! | [`sigmoid`], [`tanh`] | 1.5e-7 absolute |
//! | [`elu`] | 1.5e-7 absolute |
//! | [`silu`] | 2e-7 * max(1, abs(x)) |
//! | [`gelu`], [`gelu_tanh`] | 3e-7 * max(1, abs(x)) |

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
            Self::Gelu => each(x, gelu),
            Self::GeluTanh => each(x, gelu_tanh),
            Self::Tanh => each(x, tanh),
            Self::Sigmoid => each(x, sigmoid),
        }
    }
}

#[inline(always)]
fn each(x: &mut [f32], function: impl Fn(f32) -> f32) {
    for x in x {
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

/// `e^x`. Below -87 the result is that of -87 (1.6e-38), above 88 that of 88 (1.7e38).
///
/// `x = n ln 2 + r` with `|r| <= ln 2 / 2`, ln 2 split in two so that `r` is exact to 2^-30; `e^r` by a polynomial of degree 6
/// (fitted for the smallest relative error, 3e-9), then `n` is added to the exponent.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    const LN2_HIGH: f32 = 0.693_359_4;
    const LN2_LOW: f32 = -2.121_944_4e-4;
    let x = clamp(x, -87.0, 88.0);
    let shifted = x * core::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * LN2_HIGH - n * LN2_LOW;
    let p = 1.381_454e-3;
    let p = p * r + 8.368_745e-3;
    let p = p * r + 4.166_839e-2;
    let p = p * r + 0.166_665_21;
    let p = p * r + 0.499_999_94;
    let p = p * r * r + r + 1.0;
    // The low bits of `shifted` are n; the product with 2^23 drops what stands above them.
    f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// `max(x, 0)`
#[inline(always)]
pub fn relu(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

/// `x` where positive, else `exp(x) - 1`
#[inline(always)]
pub fn elu(x: f32) -> f32 {
    if x > 0.0 { x } else { exp(x) - 1.0 }
}

/// `1 / (1 + exp(-x))`
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + exp(-x))
}

/// `(1 - t) / (1 + t)` with `t = exp(-2 |x|)`, and the sign of `x`
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let magnitude = f32::from_bits(x.to_bits() & 0x7fff_ffff);
    let t = exp(-2.0 * magnitude);
    let y = (1.0 - t) / (1.0 + t);
    if x < 0.0 { -y } else { y }
}

/// `x * sigmoid(x)`
#[inline(always)]
pub fn silu(x: f32) -> f32 {
    x / (1.0 + exp(-x))
}

/// `x * Phi(x)`; the normal distribution by Abramowitz and Stegun, Handbook of Mathematical Functions, 7.1.26.
#[inline(always)]
pub fn gelu(x: f32) -> f32 {
    let z = f32::from_bits(x.to_bits() & 0x7fff_ffff) * core::f32::consts::FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let p = 1.061_405_4;
    let p = p * t - 1.453_152;
    let p = p * t + 1.421_413_7;
    let p = p * t - 0.284_496_74;
    let p = p * t + 0.254_829_6;
    // Half of erfc(|x| / sqrt 2): the tail beyond |x|.
    let tail = 0.5 * p * t * exp(-z * z);
    if x > 0.0 { x - x * tail } else { x * tail }
}

/// `x * sigmoid(2 u)` with `u = sqrt(2 / pi) (x + 0.044715 x^3)`, which is `x / 2 * (1 + tanh(u))`.
#[inline(always)]
pub fn gelu_tanh(x: f32) -> f32 {
    x / (1.0 + exp(-1.595_769 * (x + 0.044_715 * x * x * x)))
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
        assert!(worst(87.0, exp, f64::exp, f64::exp) < 1.5e-7);
        assert!(worst(30.0, sigmoid, sig, |_| 1.0) < 1.5e-7);
        assert!(worst(30.0, tanh, f64::tanh, |_| 1.0) < 1.5e-7);
        assert!(worst(30.0, elu, |x| if x > 0.0 { x } else { x.exp_m1() }, size) < 1.5e-7);
        assert!(worst(30.0, silu, |x| x * sig(x), size) < 2e-7);
        assert!(worst(10.0, gelu_tanh, |x| x * sig(1.595_769_121_605_731 * (x + 0.044715 * x.powi(3))), size) < 3e-7);
        // 0.5 erfc(-x / sqrt 2) by libm in f64, which is exact at this scale.
        assert!(worst(10.0, gelu, |x| x * 0.5 * libm::erfc(-x / 2f64.sqrt()), size) < 3e-7);
    }

    #[test]
    fn extremes_are_finite() {
        for x in [f32::MAX, f32::MIN, 1e-40, -0.0, 0.0] {
            for f in [exp, relu, elu, sigmoid, tanh, silu] {
                assert!(f(x).is_finite(), "{x}");
            }
        }
    }
}
