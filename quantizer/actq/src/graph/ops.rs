//! The operations. A new one needs its file and its line in the list below.

mod add;
mod concat;
mod function;
mod gru;
mod iterate;
mod linear;
mod lstm;
mod mul;
mod norm;
mod normalize;
mod table;

use std::ops::{Deref, DerefMut};

pub use add::Add;
pub use concat::{Concat, Span};
pub use function::Pointwise;
pub use gru::Gru;
pub use iterate::Iterate;
pub use linear::Linear;
pub use lstm::Lstm;
pub use mul::Mul;
pub use norm::{LayerNorm, RmsNorm};
pub use normalize::{Balance, Normalize};
pub use table::Table;

use super::operation::Operation;

macro_rules! operations {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        /// Operation of a node; dereferences to its [`Operation`].
        #[derive(Clone, Debug)]
        pub enum NodeKind {
            $($(#[$doc])* $name($name),)*
        }

        impl Deref for NodeKind {
            type Target = dyn Operation;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$name(operation) => operation,)*
                }
            }
        }

        impl DerefMut for NodeKind {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self {
                    $(Self::$name(operation) => operation,)*
                }
            }
        }

        $(impl From<$name> for NodeKind {
            fn from(operation: $name) -> Self {
                Self::$name(operation)
            }
        })*
    };
}

operations! {
    /// Mean, scale and clips of observations.
    Normalize,
    /// Mean and scale that the quantizer adds before matrices.
    Balance,
    /// A matrix product.
    Linear,
    /// A function of every element.
    Pointwise,
    /// torch's LayerNorm.
    LayerNorm,
    /// A norm without a mean.
    RmsNorm,
    /// Sum of two values.
    Add,
    /// Product of two values, element by element.
    Mul,
    /// Concatenated parts of values.
    Concat,
    /// A recurrent cell with a cell state.
    Lstm,
    /// A recurrent cell.
    Gru,
    /// The iterate of an iterative head: noise at first.
    Iterate,
    /// Constants of each denoising step.
    Table,
}
