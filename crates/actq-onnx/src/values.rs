//! Values of a graph: expressions over vectors, and tensors of their elements.

pub(crate) mod bounds;
pub(crate) mod compare;
pub(crate) mod elements;
pub(crate) mod evaluation;
pub(crate) mod expr;
pub(crate) mod tensor;
