//! Preparation of activations for a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! A prepared vector depends on the layout that reads it ([`XLayout`](crate::layout::XLayout)). It has the column
//! chunks of each group (of the whole row without group scales). If the layout needs it, a sum follows: that of the
//! row's values, or that of the group's in both halves of a word. If the layout pairs groups, a pair is prepared as a
//! group of two chunks, and the halves of its word are their sums. A chunk is its start words and its int16 pairs,
//! column `2j` in the low half; or, for Helium, bytes, the first in the lowest. Zeros fill the last group and, in a pair, a missing second group. Without groups they
//! fill a kernel's step ([`PAD_COLS`](crate::layout::PAD_COLS) with single lanes). A [`Plan`] has all lengths.

mod plan;
mod prepared;
mod scale;

pub use crate::error::NotFinite;
pub(crate) use plan::Extent;
pub use plan::KernelArguments;
pub use plan::{Plan, max_prepared_words};
pub use prepared::Prepared;
pub use prepared::prepare;
#[cfg(any(not(actq_fpu), feature = "scalar", feature = "helium"))]
pub(crate) use prepared::{cells, lay_out};
pub use scale::Scale;
pub use scale::TINY;
