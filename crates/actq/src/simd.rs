//! Vector instructions of the processor at hand. Results do not depend on them: they only decide how many elements an
//! instruction computes.

use fearless_simd::{Level, Simd, dispatch};

/// Runs `work`, compiled for the widest vectors of this processor. Only what the compiler inlines into `work` gains.
#[inline]
pub(crate) fn wide<R>(work: impl FnOnce() -> R) -> R {
    #[inline(always)]
    fn run<S: Simd, R>(simd: S, work: impl FnOnce() -> R) -> R {
        simd.vectorize(work)
    }
    dispatch!(Level::new(), simd => run(simd, work))
}
