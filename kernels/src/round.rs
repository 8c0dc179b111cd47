//! The **one rounding rule** of the project: round half to even.
//!
//! It is computed by adding `1.5 * 2^23`: for `|v| < 2^22` the sum's low mantissa bits are the rounded value in two's
//! complement. It is one FPU addition, and the same bits everywhere.

/// `1.5 * 2^23`: see the module's rounding rule.
pub const ROUND: f32 = 12_582_912.0;
