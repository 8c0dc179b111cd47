//! Constructors of expressions, which recognize activations and norms that exporters decompose.

mod affine;
mod functions;
mod limits;
mod products;
mod sums;
mod vectors;
