//! Unifies Cargo features; it has no code. Cargo enables for a crate the features that the selected packages ask for,
//! and builds it again, with all that depends on it, for a selection that asks for others. Packages that depend on this
//! one ask for the same. So the quantizer is built once for the tests, the measuring commands, the ONNX tests and the
//! Python package, and the kernels once for these and the test of the C header. No published crate depends on it.
