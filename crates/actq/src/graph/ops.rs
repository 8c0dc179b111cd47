//! The operations. A new one needs its file and its line in the list below.

/// Implements [`Operation::vectors`] and its mutable form: the fields whose values can be learned, in this order.
macro_rules! learned {
    ($($field:ident),*) => {
        fn vectors(&self) -> Vec<&Vec<f32>> {
            vec![$(&self.$field),*]
        }

        fn vectors_mut(&mut self) -> Vec<&mut Vec<f32>> {
            vec![$(&mut self.$field),*]
        }
    };
}

mod add;
mod attention;
mod concat;
mod function;
mod gru;
mod iterate;
mod linear;
mod lstm;
mod mul;
mod norm;
mod normalize;
mod recurrent;
mod rotary;
mod table;

use std::ops::{Deref, DerefMut};

pub use add::Add;
pub use attention::{Attention, MAX_HEADS};
pub use concat::{Concat, Span};
pub use function::Pointwise;
pub use gru::Gru;
pub use iterate::Iterate;
pub use linear::Linear;
pub use lstm::Lstm;
pub use mul::Mul;
pub use norm::{LayerNorm, RmsNorm};
pub use normalize::{Balance, Normalize};
pub use rotary::Rotary;
pub use table::Table;

use super::operation::Operation;
use super::syntax::Keys;
use crate::error::Result;

macro_rules! operations {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {
        /// Operation of a node; dereferences to its [`Operation`].
        #[derive(Clone, Debug, PartialEq)]
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

        impl NodeKind {
            /// Lists the names of the ops of policy.json, with their keys beside those of every op.
            pub fn syntax() -> Vec<(&'static str, &'static [&'static str])> {
                let mut all = Vec::new();
                $(all.extend($name::syntax().iter().map(|op| (op.name, op.keys)));)*
                all
            }

            /// Reads an op of policy.json; `None` if no operation has its name.
            pub fn read(op: &mut dyn Keys) -> Result<Option<Self>> {
                $(if let Some(syntax) = $name::syntax().iter().find(|syntax| syntax.name == op.op()) {
                    return Ok(Some((syntax.read)(op)?.into()));
                })*
                Ok(None)
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
    /// torch's LayerNorm.
    LayerNorm,
    /// A norm without a mean.
    RmsNorm,
    /// Sum of two values.
    Add,
    /// Product of two values, element by element.
    Mul,
    /// Attention of queries to keys and values.
    Attention,
    /// Rotary positions of queries or keys.
    Rotary,
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
    /// A function of every element.
    Pointwise,
}
