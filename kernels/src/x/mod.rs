//! Activations on their way into a GEMV: from f32 to int16 pairs with one scale for the vector, found at run time.
//!
//! A prepared vector is made for the layout that reads it ([`XLayout`](crate::layout::XLayout)): for each group of
//! columns (the whole row where the weights have no group scales) its chunks, and behind them, where the layout asks
//! for it, the sum of the row's values, or, in both halves of a word, of the group's. Where the layout takes groups in
//! pairs, a pair is prepared as a group of two chunks, and the halves of its word are their sums. A chunk is its start
//! words and its int16 pairs, column `2j` in the low half. Zeros fill the last group (and, in pairs, the place of one
//! that a last group lacks), or, where there are no groups, a kernel's step ([`PAD_COLS`](crate::layout::PAD_COLS) with
//! single lanes). A [`Plan`] has all lengths.

mod plan;
mod prepared;
mod scale;

#[cfg(feature = "writer")]
pub use crate::error::NotFinite;
pub(crate) use plan::Extent;
#[cfg(feature = "writer")]
pub use plan::KernelArguments;
pub use plan::{Plan, max_prepared_words};
pub use prepared::Prepared;
#[cfg(not(actq_fpu))]
pub(crate) use prepared::lay_out;
#[cfg(feature = "writer")]
pub use prepared::prepare;
pub use scale::Scale;
#[cfg(feature = "writer")]
pub use scale::TINY;
