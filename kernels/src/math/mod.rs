//! Elementary functions in f32 by additions, multiplications and at most one division: no tables and no calls to a
//! system library, so the same bits on every machine. The crate's tests assert the error bounds over dense sweeps of
//! small and large inputs. `host-tests/tests/all/on_target/functions.rs` asserts that each function takes at most 30
//! instructions per element on the Cortex-M4's FPU (exp, cos and softplus at most 38).
//!
//! | function | error bound, against the exact value |
//! |---|---|
//! | [`exp`] | 2.2e-7 * max(1, abs(x)) relative, for -87 < x < 87 |
//! | [`sigmoid`] | 1.1e-7 absolute |
//! | [`tanh`] | 1.5e-7 absolute |
//! | [`elu`] | 1.2e-7 absolute |
//! | [`silu`], [`gelu_tanh`] | 1.4e-7 * max(1, abs(x)) |
//! | [`gelu`] | 1.8e-7 * max(1, abs(x)) |
//! | [`softplus`] | 1.6e-7 * max(1, abs(x)) |
//! | [`mish`], [`sin`], [`cos`] | 1.5e-7 * max(1, abs(x)) |
//!
//! If the input is NaN, so is the result; no function turns an infinite number into a finite one.

pub(crate) mod exp2;
mod functions;
mod limits;
pub(crate) mod real;
#[cfg(any(all(test, feature = "writer"), actq_soft))]
pub(crate) mod soft;

pub use functions::Function;
pub use functions::sigmoid;
pub use functions::{cos, elu, exp, gelu, gelu_tanh, mish, relu, silu, sin, softplus, tanh};
pub(crate) use limits::zero_or_nan;
pub use limits::{ORIENTATION, clamp};
pub(crate) use real::{Native, Real};
