//! The numbers that the functions calculate with: f32, or their twin in integers.

use core::ops::{Add, Div, Mul, Sub};

use super::exp2::{self, QUARTER, exp_fraction, tanh_fraction};
use super::functions::Ratio;
use crate::round::ROUND;

/// The numbers of this build: by integers for a core without an FPU.
#[cfg(not(actq_soft))]
pub(crate) type Native = f32;
/// The numbers of this build: by integers for a core without an FPU.
#[cfg(actq_soft)]
pub(crate) type Native = super::soft::Soft<{ cfg!(actq_narrow) }>;

/// An f32. Every operation has the same bits in all types.
pub trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    /// Converts an f32.
    fn of(x: f32) -> Self;

    /// Returns the f32.
    fn get(self) -> f32;

    /// Returns `self > end`, for an `end` that is not negative.
    fn is_above(self, end: f32) -> bool;

    /// Drops the fraction, and limits the number to those of an i32; NaN becomes 0.
    fn truncated(self) -> Self;

    /// Computes `2^(self / one)` as a fraction: see `math::exp2::exp2`.
    fn power(self, one: f32) -> (Self, Self);

    /// Computes a [`Ratio`], without its end.
    fn ratio(self, ratio: &Ratio) -> Self;

    /// Computes `1 / (1 + exp(-self))`.
    #[inline(always)]
    fn sigmoid(self) -> Self {
        let (n, d) = exp_fraction(self);
        n / (n + d)
    }

    /// Computes `sigmoid(self) * tanh(x)` with one division.
    #[cfg_attr(actq_fpu, allow(dead_code, reason = "with an FPU, cells are in assembler"))]
    #[inline(always)]
    fn gate(self, x: Self) -> Self {
        let (on, off) = exp_fraction(self);
        let (n, d) = tanh_fraction(x);
        (on * n) / ((on + off) * d)
    }

    /// Rounds `self * factor`, of finite numbers, to an integer of 16 bits; the result's other bits have no meaning.
    #[cfg_attr(actq_fpu, allow(dead_code, reason = "with an FPU, vectors are quantized in assembler"))]
    fn rounded(self, factor: f32) -> u32;

    /// Adds `sum * (scale * x_scale)` to y, for a scale that is a bf16.
    fn add_scaled(y: &mut f32, sum: i32, scale: f32, x_scale: f32);
}

impl Real for f32 {
    #[inline(always)]
    fn of(x: f32) -> Self {
        x
    }

    #[inline(always)]
    fn get(self) -> f32 {
        self
    }

    #[inline(always)]
    fn is_above(self, end: f32) -> bool {
        self > end
    }

    #[inline(always)]
    fn truncated(self) -> Self {
        self as i32 as f32
    }

    #[inline(always)]
    fn power(self, one: f32) -> (Self, Self) {
        exp2::exp2(self, one)
    }

    #[inline(always)]
    fn ratio(self, ratio: &Ratio) -> Self {
        let (n, d) = exp2::exp2(self * ratio.factor, QUARTER);
        (n - ratio.a * d) / (ratio.b * n + d)
    }

    #[inline(always)]
    fn rounded(self, factor: f32) -> u32 {
        (self * factor + ROUND).to_bits()
    }

    #[inline(always)]
    fn add_scaled(y: &mut f32, sum: i32, scale: f32, x_scale: f32) {
        *y += sum as f32 * (scale * x_scale);
    }
}
