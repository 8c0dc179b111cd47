//! Kernels with more than one backend, and the one place that chooses the backend.
//!
//! `reference` is the standard that tests compare all others with, `portable` is Rust for every target, `armv7em`
//! assembler for Cortex-M4, M7 and M33, and `armv7em_fpu` assembler that also needs their FPU's registers. `helium` adds
//! what Cortex-M55 and M85 do with vectors. All of them
//! compute the same bits; the tests run them on the same data. On cores without the DSP extension, `portable` has its
//! innermost loops in assembler: `loops` for the scalar layouts, `scaling` for the results. The build script detects the backends of a target.

/// The first line of a file. A module's assembler accepts the instructions of its architecture, which for Armv8-M
/// exclude the DSP extension whatever processor the build names; so the file names the processor.
#[cfg(all(actq_armv7em, actq_armv8m))]
macro_rules! processor {
    () => {
        ".cpu cortex-m33"
    };
}
#[cfg(all(actq_armv7em, not(actq_armv8m)))]
macro_rules! processor {
    () => {
        ""
    };
}

/// The symbol `COMPACT` in a file: 1 where loops are short.
#[cfg(all(actq_armv7em, feature = "compact"))]
macro_rules! compact {
    () => {
        ".set COMPACT, 1"
    };
}
#[cfg(all(actq_armv7em, not(feature = "compact")))]
macro_rules! compact {
    () => {
        ".set COMPACT, 0"
    };
}

/// Assembles a file.
#[cfg(actq_armv7em)]
macro_rules! assembler {
    ($file:literal) => {
        core::arch::global_asm!(processor!(), compact!(), include_str!($file), options(raw));
    };
}

#[cfg(actq_armv7em)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
mod armv7em;
#[cfg(actq_fpu)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
mod armv7em_fpu;
#[cfg(actq_helium)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
mod helium;
#[cfg(all(actq_loops, feature = "scalar"))]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
mod loops;
pub mod portable;
mod product;
pub mod reference;
#[cfg(actq_scaling)]
#[allow(unsafe_code, reason = "the assembler backend; every block carries its proof")]
mod scaling;
mod tables;

#[cfg(actq_armv7em)]
use armv7em as integers;
#[cfg(actq_fpu)]
use armv7em_fpu as floats;
#[cfg(actq_helium)]
use helium as bytes;
#[cfg(not(actq_fpu))]
use portable as floats;
#[cfg(all(feature = "helium", not(actq_helium)))]
use portable as bytes;
#[cfg(not(actq_armv7em))]
use portable as integers;

#[cfg(not(any(actq_scaling, actq_helium)))]
pub(crate) use floats::scale;
pub(crate) use floats::{denoise, gru_elements, lstm_elements, normalize, sqrt, standardize, sum, sum_squares};
#[cfg(actq_helium)]
pub(crate) use helium::{elu, relu, scale};
pub(crate) use integers::copy;
#[cfg(feature = "checksums")]
pub(crate) use integers::xor;
#[cfg(feature = "attention")]
pub(crate) use integers::{query_keys, weigh_values};
pub use product::{Mismatch, Product};
#[cfg(actq_scaling)]
pub(crate) use scaling::scale;
pub use tables::Tables;
#[cfg(all(feature = "writer", feature = "scalar"))]
pub(crate) use tables::{LEAST_PAIRS, TABLE_WORDS, TWO_COLUMNS};

use crate::activations::{Plan, Prepared, Scale};
use crate::error::NotFinite;
use crate::layout::Block;
#[cfg(any(feature = "scalar", feature = "helium"))]
use crate::layout::Lanes;

/// A backend that can be compiled in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Plain Rust, for any target.
    Portable,
    /// Assembler for Cortex-M4, M7 and M33.
    Armv7em,
    /// The same, and assembler for the Helium of Cortex-M55 and M85.
    Helium,
}

/// The backend of this build.
pub const BACKEND: Backend = match (cfg!(actq_helium), cfg!(actq_armv7em)) {
    (true, _) => Backend::Helium,
    (false, true) => Backend::Armv7em,
    (false, false) => Backend::Portable,
};

/// Multiplies a run of a block's rows ([`Product::new`]) with a prepared vector.
///
/// `acc[i]` becomes `sum over groups of scale * sum over columns of level * x`, modulo 2^32, for row `first_row + i`.
/// The sums of padding rows have no meaning.
///
/// The true sum fits an i32 by [`crate::Image::new_checked`]'s check of the worst case.
///
/// # Errors
///
/// [`Mismatch`] if block, vector and `acc` do not fit each other.
#[inline(always)]
pub fn gemv(block: &Block<'_>, x: &Prepared<'_>, first_row: usize, acc: &mut [i32]) -> Result<(), Mismatch> {
    gemv_with(block, x, first_row, acc, Tables::default())
}

/// Does the same as [`gemv`] with memory for tables. Without it, bit planes take more time and a table on the stack.
///
/// # Errors
///
/// As [`gemv`].
#[inline(never)]
pub fn gemv_with(
    block: &Block<'_>,
    x: &Prepared<'_>,
    first_row: usize,
    acc: &mut [i32],
    tables: Tables<'_>,
) -> Result<(), Mismatch> {
    integers::gemv(Product { tables, ..Product::new(block, x, first_row, acc)? });
    Ok(())
}

impl Scale {
    /// Computes the scale of `x` for integers in `-x_max ..= x_max`. `x_max` is 127 for int8 activations and at most
    /// 32767.
    ///
    /// # Errors
    ///
    /// [`NotFinite`] if a value of `x` is NaN or infinite.
    pub fn new(x: &[f32], x_max: u16) -> Result<Self, NotFinite> {
        #[cfg(actq_helium)]
        return Self::of_magnitude(helium::magnitude(x), x_max);
        #[cfg(not(actq_helium))]
        Self::of_magnitude(integers::magnitude(x), x_max)
    }

    /// Quantizes `x` with `plan` to the first words of `out`, and returns the prepared vector. Missing values of `x`
    /// count as zeros. `None`, with nothing written, if `out` is shorter than [`Plan::room`]; it may overwrite all of
    /// these words.
    ///
    /// `x` stays as it is. (It is borrowed as memory that may change, for which [`Self::quantize_in_place`] has the code.)
    pub fn quantize<'w>(self, x: &mut [f32], plan: &'w Plan, out: &'w mut [u32]) -> Option<Prepared<'w>> {
        let len = x.len().min(plan.shape.cols);
        self.quantize_to(x.get_mut(..len), plan, out)
    }

    /// Quantizes the bits of f32 values with `plan` to the first of their own words, and returns the prepared vector. `None`,
    /// with nothing written, unless the vector has the plan's columns and fills its groups ([`Plan::fits_in_place`]).
    pub fn quantize_in_place<'w>(self, plan: &'w Plan, x: &'w mut [u32]) -> Option<Prepared<'w>> {
        if x.len() == plan.shape.cols && plan.fits_in_place() { self.quantize_to(None, plan, x) } else { None }
    }

    /// Does the same as [`Self::quantize`], or without `x` as [`Self::quantize_in_place`].
    #[inline(never)]
    pub(crate) fn quantize_to<'w>(
        self,
        x: Option<&mut [f32]>,
        plan: &'w Plan,
        out: &'w mut [u32],
    ) -> Option<Prepared<'w>> {
        // The assembler has the forms of the DSP extension's layouts.
        #[cfg(feature = "scalar")]
        if plan.shape.lanes == Lanes::Scalar {
            portable::quantize(x, self.inverse(), plan, out)?;
            return Prepared::new(out, plan);
        }
        #[cfg(feature = "helium")]
        if plan.shape.lanes == Lanes::Helium {
            bytes::quantize(x, self.inverse(), plan, out)?;
            return Prepared::new(out, plan);
        }
        floats::quantize(x, self.inverse(), plan, out)?;
        Prepared::new(out, plan)
    }
}
