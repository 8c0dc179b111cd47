//! The extension module of the Python package `actq`. `python/actq` has the functions that users call: they check and
//! complete the arguments of those here.

mod arrays;
mod error;
mod head;
mod image;
mod link;
mod policy;
mod process;
mod quantize;
mod recordings;
mod tune;
mod work;

/// The compiled part of the package `actq`.
#[pyo3::pymodule]
mod _actq {
    #[pymodule_export]
    use crate::error::Error;
    #[pymodule_export]
    use crate::head::{Head, head_of_states};
    #[pymodule_export]
    use crate::image::{Image, write_text};
    #[pymodule_export]
    use crate::link::Link;
    #[pymodule_export]
    use crate::policy::{Policy, import_onnx, import_path, policy_of_files};
    #[pymodule_export]
    use crate::quantize::{bytes_of, evaluate, quantize};
    #[pymodule_export]
    use crate::tune::{stand_in, tune};

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "Python's name")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
