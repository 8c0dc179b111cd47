//! The elementwise functions.

use super::exp2::tanh_fraction;
use super::exp2::{EXP, EXPONENT, FIXED_ONE, QUARTER, exp_fraction, fraction, power};
use super::limits::zero_or_nan;
use super::real::{Native, Real};
use crate::round::ROUND;

macro_rules! functions {
    ($($(#[$doc:meta])* $function:ident = $code:literal, $name:literal $(if $feature:literal)?;)*) => {
        /// The elementwise functions of an image.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Function {
            $($(#[$doc])* $function = $code,)*
        }

        impl Function {
            /// All functions, in the order of their codes.
            pub const ALL: [Self; [$($code),*].len()] = [$(Self::$function),*];

            /// Returns the name, as in policy.json.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$function => $name,)*
                }
            }

            /// Returns the feature of this crate with the function; empty if every build has it.
            pub(crate) const fn feature(self) -> &'static str {
                match self {
                    $(Self::$function => concat!($($feature)?),)*
                }
            }

            /// Returns `true` if this build has the function.
            pub(crate) const fn is_built(self) -> bool {
                match self {
                    $(Self::$function => true $(&& cfg!(feature = $feature))?,)*
                }
            }
        }
    };
}
functions! {
    /// `max(x, 0)`
    Relu = 0, "relu";
    /// `x` if positive, otherwise `exp(x) - 1`
    Elu = 1, "elu" if "elu";
    /// `x * sigmoid(x)`
    Silu = 2, "silu" if "silu";
    /// `x * Phi(x)` with the exact normal distribution
    Gelu = 3, "gelu" if "functions";
    /// GELU by its tanh approximation, as torch's `approximate="tanh"`
    GeluTanh = 4, "gelu_tanh" if "functions";
    /// Hyperbolic tangent
    Tanh = 5, "tanh" if "elu";
    /// `1 / (1 + exp(-x))`
    Sigmoid = 6, "sigmoid" if "elu";
    /// `e^x`
    Exp = 7, "exp" if "functions";
    /// Sine, of radians
    Sin = 8, "sin" if "functions";
    /// Cosine, of radians
    Cos = 9, "cos" if "functions";
    /// `ln(1 + exp(x))`
    Softplus = 10, "softplus" if "functions";
    /// `x * tanh(softplus(x))`
    Mish = 11, "mish" if "functions";
}

impl Function {
    /// Returns the function of a code in an image.
    pub const fn from_code(code: u8) -> Option<Self> {
        if (code as usize) < Self::ALL.len() { Some(Self::ALL[code as usize]) } else { None }
    }

    /// Applies the function to every element.
    pub fn apply(self, x: &mut [f32]) {
        match self {
            #[cfg(actq_helium)]
            Self::Relu => crate::arch::relu(x),
            #[cfg(not(actq_helium))]
            Self::Relu => in_pairs(x, |pairs| each(pairs, |[a, b]| [relu(a), relu(b)])),
            // A checked image has no function that the build leaves out.
            Self::Elu | Self::Tanh | Self::Sigmoid if !cfg!(feature = "elu") => {}
            #[cfg(actq_helium)]
            Self::Elu => crate::arch::elu(x),
            #[cfg(not(actq_helium))]
            Self::Elu => each_ratio(x, &ELU),
            Self::Tanh => each_ratio(x, &TANH),
            Self::Sigmoid => each_ratio(x, &SIGMOID),
            Self::Silu if !cfg!(feature = "silu") => {}
            Self::Silu => each(x, |x| native(silu, x)),
            _ if !cfg!(feature = "functions") => {}
            Self::Gelu => in_pairs(x, |pairs| each(pairs, |[a, b]| [native(gelu, a), native(gelu, b)])),
            Self::GeluTanh => each(x, |x| native(gelu_tanh, x)),
            Self::Exp => in_pairs(x, |pairs| each(pairs, |[a, b]| [native(exp, a), native(exp, b)])),
            Self::Sin => in_pairs(x, |pairs| each(pairs, |[a, b]| [native(sin, a), native(sin, b)])),
            Self::Cos => in_pairs(x, |pairs| each(pairs, |[a, b]| [native(cos, a), native(cos, b)])),
            Self::Softplus => in_pairs(x, |pairs| each(pairs, |[a, b]| [native(softplus, a), native(softplus, b)])),
            Self::Mish => each(x, |x| native(mish, x)),
        }
    }

    /// Applies the function to every element, as [`Function::apply`] does, in a loop of its own that is inlined: a
    /// caller that is compiled for vectors gets a loop of vectors.
    #[inline(always)]
    pub fn apply_inlined(self, x: &mut [f32]) {
        match self {
            Self::Relu => each_inlined(x, relu),
            Self::Elu => each_inlined(x, elu),
            Self::Silu => each_inlined(x, silu),
            Self::Gelu => each_inlined(x, gelu),
            Self::GeluTanh => each_inlined(x, gelu_tanh),
            Self::Tanh => each_inlined(x, tanh),
            Self::Sigmoid => each_inlined(x, sigmoid),
            Self::Exp => each_inlined(x, exp),
            Self::Sin => each_inlined(x, sin),
            Self::Cos => each_inlined(x, cos),
            Self::Softplus => each_inlined(x, softplus),
            Self::Mish => each_inlined(x, mish),
        }
    }
}

/// Calculates with this build's numbers.
#[inline(always)]
fn native(function: impl Fn(Native) -> Native, x: f32) -> f32 {
    function(Native::of(x)).get()
}

/// It reads a copy: of a function that returns some values unchanged, as ELU does, the compiler would otherwise make a
/// masked store, which takes AMD's Zen cores longer than the function itself.
#[inline(always)]
fn each_inlined(x: &mut [f32], function: impl Fn(f32) -> f32) {
    let mut copy = [0.0; 128];
    for y in x.chunks_mut(copy.len()) {
        let x = &mut copy[..y.len()];
        x.copy_from_slice(y);
        y.iter_mut().zip(x).for_each(|(y, x)| *y = function(*x));
    }
}

/// Applies a function in a loop of its own, which is not inlined: the functions take most of the executor's code.
#[inline(never)]
fn each<T: Copy>(x: &mut [T], function: impl Fn(T) -> T) {
    for x in x {
        *x = function(*x);
    }
}

/// Applies a function to two elements in a pass, for few instructions of the loop; an odd element takes one more call
/// of `each`.
#[inline(never)]
fn in_pairs(x: &mut [f32], each: fn(&mut [[f32; 2]])) {
    let (odd, pairs) = x.as_rchunks_mut::<2>();
    if let [odd] = odd {
        let mut pair = [[*odd; 2]];
        each(&mut pair);
        *odd = pair[0][0];
    }
    each(pairs);
}

/// A function `(n - a d) / (b n + d)` with `n / d = 2^(factor x)`, in quarters; above `end` it is x itself. `a` and `b`
/// are 0 or 1.
pub struct Ratio {
    pub(super) factor: f32,
    pub(super) a: f32,
    pub(super) b: f32,
    end: f32,
}

const ELU: Ratio = Ratio { factor: EXP, a: 1.0, b: 0.0, end: 0.0 };
const TANH: Ratio = Ratio { factor: 2.0 * EXP, a: 1.0, b: 1.0, end: f32::INFINITY };
pub(super) const SIGMOID: Ratio = Ratio { factor: EXP, a: 0.0, b: 1.0, end: f32::INFINITY };

impl Ratio {
    #[inline(always)]
    fn of<R: Real>(&self, x: R) -> R {
        if x.is_above(self.end) {
            return x;
        }
        x.ratio(self)
    }
}

/// Applies a function of this form in a loop that they share.
#[inline(never)]
fn each_ratio(x: &mut [f32], ratio: &Ratio) {
    for x in x {
        *x = native(|x| ratio.of(x), *x);
    }
}

/// Computes `e^x`, infinite outside f32's range: whole powers of two by two factors, because one does not reach f32's
/// limits, and a fraction for the rest.
#[inline(always)]
pub fn exp<R: Real>(x: R) -> R {
    // Limited by its bits: magnitudes compare as their bits.
    const END: u32 = 250f32.to_bits();
    let y = (x * R::of(core::f32::consts::LOG2_E)).get().to_bits();
    let y = R::of(f32::from_bits(if y << 1 > END << 1 { y & (1 << 31) | END } else { y }));
    // The sum's last bits are the whole part; here they move to the bits of an exponent.
    let sum = y + R::of(ROUND);
    let whole = (sum.get().to_bits() << EXPONENT) as i32;
    let (n, d) = fraction(y - (sum - R::of(ROUND)), 1.0);
    let half = whole >> 1 & (-1 << EXPONENT);
    n / d * R::of(power(half)) * R::of(power(whole - half)) + zero_or_nan(x)
}

/// A zero of sine and of cosine, in half turns.
const SIN: f32 = 0.0;
const COS: f32 = 0.5;

/// Computes the sine of radians
#[inline(always)]
pub fn sin<R: Real>(x: R) -> R {
    wave(x, SIN)
}

/// Computes the cosine of radians
#[inline(always)]
pub fn cos<R: Real>(x: R) -> R {
    wave(x, COS)
}

/// Computes a sine wave with zeros at `zero` and at every half turn from it, rising at every other one: the sine of the
/// difference of x from the nearest zero. Half turns are subtracted in two parts, as Cody and Waite do; f32 multiplies
/// the first part without error with every number of half turns below 2^16. The sine is a polynomial, fitted for the
/// smallest error, 3e-9.
#[inline(always)]
fn wave<R: Real>(x: R, zero: f32) -> R {
    const TURN: [f32; 2] = [3.140_625, 9.676_536e-4];
    let c = R::of;
    let turns = (x * c(core::f32::consts::FRAC_1_PI) - c(zero)) + c(ROUND);
    let n = (turns - c(ROUND)) + c(zero);
    let r = (x - n * c(TURN[0])) - n * c(TURN[1]);
    let turns = turns.get().to_bits();
    // Above 2^22 half turns, the sum has another exponent than ROUND, and x does not determine the angle.
    let r = if turns >> 23 == ROUND.to_bits() >> 23 { r } else { c(0.0) * x };
    // ROUND is even: the sum's last bit is 1 if the number of half turns is odd. Then the sine falls.
    let falls = (turns << 31) ^ (((zero != 0.0) as u32) << 31);
    let r = c(f32::from_bits(r.get().to_bits() ^ falls));
    let square = r * r;
    let p = c(2.590_488_5e-6) * square - c(1.980_089_7e-4);
    let p = p * square + c(8.332_9e-3);
    let p = p * square - c(0.166_666_48);
    p * square * r + r
}

/// Computes `ln(1 + exp(x)) = max(x, 0) + ln(1 + e)` with `e = exp(-|x|) = n / d`; of that, `ln(1 + e) = 2 artanh(s)`
/// with `s = e / (2 + e)` at most 1/3, by a polynomial that was fitted for the smallest error, 1.4e-9.
#[inline(always)]
pub fn softplus<R: Real>(x: R) -> R {
    let c = R::of;
    let half = c(0.5) * x;
    let magnitude = c(half.get().abs());
    let (n, d) = (magnitude * c(-2.0 * EXP)).power(QUARTER);
    // 2 s, and so 2^-2k for k powers of s in the polynomial.
    let t = n / (c(0.5) * n + d);
    let square = t * t;
    let p = c(0.288_700_2 / 512.0) * square + c(0.277_875_78 / 128.0);
    let p = p * square + c(0.400_393_4 / 32.0);
    let p = p * square + c(0.666_658_7 / 8.0);
    // Half and its magnitude are max(x, 0) without a comparison.
    (half + magnitude) + (p * square * t + t)
}

/// Computes `x * tanh(softplus(x))`, which is `x w / (w + 2)` with `w = e (e + 2)` and `e = exp(x) = n / d`.
#[inline(always)]
pub fn mish<R: Real>(x: R) -> R {
    let (n, d) = exp_fraction(x);
    let w = n * (n + R::of(2.0) * d);
    x * (w / (w + R::of(2.0) * (d * d)))
}

/// Computes `max(x, 0)`; a number that is not finite stays unchanged, so that an overflow stays visible. It compares
/// the bits as a signed number: finite negative numbers are below minus infinity, which is below all others.
#[inline(always)]
pub fn relu(x: f32) -> f32 {
    let bits = x.to_bits() as i32;
    f32::from_bits(if bits < f32::NEG_INFINITY.to_bits() as i32 { 0 } else { bits as u32 })
}

/// Computes `x` if positive, otherwise `exp(x) - 1`
#[inline(always)]
pub fn elu<R: Real>(x: R) -> R {
    ELU.of(x)
}

/// Computes `1 / (1 + exp(-x))`
#[inline(always)]
pub fn sigmoid<R: Real>(x: R) -> R {
    x.sigmoid()
}

/// Computes `(e - 1) / (e + 1)` with `e = exp(2 x)`
#[inline(always)]
pub fn tanh<R: Real>(x: R) -> R {
    let (n, d) = tanh_fraction(x);
    n / d
}

/// Computes `x * sigmoid(x)`
#[inline(always)]
pub fn silu<R: Real>(x: R) -> R {
    x * sigmoid(x)
}

/// Computes `max(x, 0) - a * tail(a)` with `a = |x|`. `tail = 1 - Phi` is `p^8`, a power of a polynomial that was
/// fitted for the smallest error of `a * tail / max(1, a)`, 5e-8. From 5.5 on, `a * tail` is below 1.1e-7 and keeps its
/// value at 5.5. The code takes half of `a`, whose double is in `p^8`.
#[inline(always)]
pub fn gelu<R: Real>(x: R) -> R {
    const END: f32 = 5.5 / 2.0;
    let c = R::of;
    let half = c(0.5) * x;
    let magnitude = c(half.get().abs());
    let a = if magnitude.is_above(END) { c(END) } else { magnitude };
    // max(x, 0) without a comparison.
    let positive = half + magnitude;
    let p = c(4.969_945e-4);
    let p = p * a - c(2.747_417_2e-3);
    let p = p * a - c(8.232_198e-4);
    let p = p * a + c(2.781_584_9e-2);
    let p = p * a - c(6.546_224e-3);
    let p = p * a - c(0.139_111_97);
    let p = p * a - c(0.199_487_34);
    let p = p * a + c(1.000_000_6);
    let p = p * p;
    let p = p * p;
    positive - p * p * a
}

/// Computes `x * sigmoid(2 u)` with `u = sqrt(2 / pi) (x + 0.044715 x^3)`, which is `x / 2 * (1 + tanh(u))`.
#[inline(always)]
pub fn gelu_tanh<R: Real>(x: R) -> R {
    // The factors of x and x^3 in 2 u log2(e).
    let y = x * (R::of(2.302_208_2 * FIXED_ONE) + R::of(0.102_943_24 * FIXED_ONE) * (x * x));
    // The conversion to an integer limits it to -32 ..= 32: the cube of a large x is not finite.
    let (n, d) = y.truncated().power(FIXED_ONE);
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
        let plus = |x: f64| x.max(0.0) + (-x.abs()).exp().ln_1p();
        // 2 sqrt(2 / pi)
        let u = |x: f64| 1.595_769_121_605_731 * (x + 0.044715 * x.powi(3));
        assert!(worst(87.0, exp, f64::exp, |x| x.exp() * size(x)) < 2.2e-7);
        // Near zero, around the bends of the functions, above their limits, and far above.
        for range in [1.0, 8.0, 40.0, 1e4, 1e30] {
            assert!(worst(range, sigmoid, sig, one) < 1.1e-7);
            assert!(worst(range, tanh, f64::tanh, one) < 1.5e-7);
            assert!(worst(range, elu, |x| if x > 0.0 { x } else { x.exp_m1() }, one) < 1.2e-7);
            assert!(worst(range, silu, |x| x * sig(x), size) < 1.4e-7);
            assert!(worst(range, gelu_tanh, |x| x * sig(u(x)), size) < 1.4e-7);
            assert!(worst(range, sin, f64::sin, size) < 1.5e-7);
            assert!(worst(range, cos, f64::cos, size) < 1.5e-7);
            assert!(worst(range, softplus, plus, size) < 1.6e-7);
            assert!(worst(range, mish, |x| x * plus(x).tanh(), size) < 1.5e-7);
            // 0.5 erfc(-x / sqrt 2) by libm in f64, which is exact at this scale.
            assert!(worst(range, gelu, |x| x * 0.5 * libm::erfc(-x / 2f64.sqrt()), size) < 1.8e-7);
        }
    }

    /// Without the limit of the exponent, large inputs would give wrong results in many ways.
    #[test]
    fn every_magnitude_has_a_plausible_value() {
        for bits in (0..0x7f80_0000u32).step_by(4001) {
            let x = f32::from_bits(bits);
            for x in [x, -x] {
                let sign = if x > 0.0 { 1.0 } else { 0.0 };
                assert!((0.0..=1.0).contains(&sigmoid(x)) && (-1.0..=1.0).contains(&tanh(x)), "{x}");
                assert!(
                    x.abs() < 50.0 || (sigmoid(x) - sign).abs() < 1e-9 && (tanh(x) + 1.0 - 2.0 * sign) == 0.0,
                    "{x}"
                );
                assert!(sin(x).abs() <= 1.0 + f32::EPSILON && cos(x).abs() <= 1.0 + f32::EPSILON, "{x}");
                for f in [elu, silu, gelu, gelu_tanh, softplus, mish] {
                    assert!((f(x) - x * sign).abs() <= 1f32.max(1e-7 * x.abs()), "{x}");
                }
            }
        }
    }

    #[test]
    fn loops_give_the_bits_of_their_functions() {
        let functions = [relu, elu, silu, gelu, gelu_tanh, tanh, sigmoid, exp, sin, cos, softplus, mish];
        let x: [f32; 999] = core::array::from_fn(|i| (i as f32 - 499.0) / 31.0);
        for (function, of) in Function::ALL.into_iter().zip(functions).filter(|(function, _)| function.is_built()) {
            let mut y = x;
            function.apply(&mut y);
            assert_eq!(y.map(f32::to_bits), x.map(|x| of(x).to_bits()), "{}", function.name());
        }
    }

    #[test]
    fn nan_stays_nan() {
        for f in [exp, elu, sigmoid, tanh, silu, gelu, gelu_tanh, sin, cos, softplus, mish] {
            assert!(f(f32::NAN).is_nan() && f(-f32::NAN).is_nan());
        }
    }

    #[test]
    fn extremes_are_finite() {
        for x in [f32::MAX, f32::MIN, 1e-40, -0.0, 0.0] {
            for f in [relu, elu, sigmoid, tanh, silu, gelu, gelu_tanh, sin, cos, softplus, mish] {
                assert!(f(x).is_finite(), "{x}");
            }
            assert!(sin(x).abs() <= 1.0 && cos(x).abs() <= 1.0, "{x}");
        }
        // An overflow of f32 stays visible.
        assert_eq!([exp(89.0), exp(f32::MAX), exp(-104.5), exp(f32::MIN)], [f32::INFINITY, f32::INFINITY, 0.0, 0.0]);
        assert!(!exp(f32::INFINITY).is_finite() && !exp(f32::NEG_INFINITY).is_finite());
    }
}
