//! Recognition of patterns that exporters decompose: norms, activations, cells, rows, slices.

pub(crate) mod attention;
pub(crate) mod build;
pub(crate) mod forms;
pub(crate) mod norm;
pub(crate) mod parts;
pub(crate) mod rotary;
pub(crate) mod rows;
pub(crate) mod select;
pub(crate) mod simplify;
pub(crate) mod slices;
pub(crate) mod totals;
