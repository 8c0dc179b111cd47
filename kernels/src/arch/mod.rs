//! What has more than one backend, and the one place that chooses.
//!
//! [`reference`] is what all others are compared with, [`portable`] plain Rust for every target, `armv7em` assembler for Cortex-M4 and
//! M7, `armv7em_fpu` what needs their FPU's registers as well. All of them compute the same bits; the tests run them on the same
//! data. The build script says what a target has.

#[cfg(actq_armv7em)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
pub mod armv7em;
#[cfg(actq_fpu)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
pub mod armv7em_fpu;
mod gemv;
pub mod portable;
mod quantize;
pub mod reference;

#[cfg(actq_armv7em)]
use armv7em as integers;
#[cfg(actq_fpu)]
use armv7em_fpu as floats;
#[cfg(not(actq_fpu))]
use portable as floats;
#[cfg(not(actq_armv7em))]
use portable as integers;

pub(crate) use floats::{gru_elements, lstm_elements, scale, sqrt};
pub use gemv::{Mismatch, Product, gemv};
pub(crate) use integers::copy;

/// A backend that can be compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// [`portable`].
    Portable,
    /// `armv7em`: assembler for Cortex-M4 and M7.
    Armv7em,
}

/// The backend that [`gemv`] has in this build.
pub const BACKEND: Backend = if cfg!(actq_armv7em) { Backend::Armv7em } else { Backend::Portable };
