//! The **one rounding rule** of the project: round half to even.
//!
//! Adding `1.5 * 2^23` computes it: for `|v| < 2^22` the sum's low mantissa bits are the rounded value in two's
//! complement. It is one FPU addition, with the same bits on every machine.

/// `1.5 * 2^23`, for the rounding rule of this module.
pub const ROUND: f32 = 12_582_912.0;
