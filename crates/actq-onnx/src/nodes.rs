//! The conversion of each ONNX operator to expressions.

pub(crate) mod arithmetic;
pub(crate) mod attention;
pub(crate) mod call;
pub(crate) mod cells;
pub(crate) mod conditions;
pub(crate) mod convolutions;
pub(crate) mod einsum;
pub(crate) mod follow;
pub(crate) mod functions;
pub(crate) mod gather;
pub(crate) mod integers;
pub(crate) mod known;
pub(crate) mod moves;
pub(crate) mod places;
pub(crate) mod pointwise;
pub(crate) mod pools;
pub(crate) mod products;
pub(crate) mod reductions;
