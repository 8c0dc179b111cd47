//! Nothing but features. Cargo enables for a crate what the selected packages ask for, and builds it again, with all that depends on it,
//! for a selection that asks for less or more. Packages that depend on this one ask for the same, so the quantizer is built once for the
//! tests, the measuring commands, the ONNX tests and the Python package, and the kernels once for these and the test of the C header.
//! What is published does not depend on it.
