//! Arrays of numpy as the arrays of recordings.

use actq::import::values::{Tensor, Values};
use numpy::{Element, PyArrayDyn, PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::prelude::*;

use crate::error::of_python;

/// Copies an array, or what numpy makes one of. Types that no recording has are passed on by their names only.
pub(crate) fn tensor(object: &Bound<'_, PyAny>) -> PyResult<Tensor> {
    let asarray = object.py().import("numpy")?.getattr("asarray")?;
    let array = asarray.call1((object,)).map_err(|error| of_python(object.py(), error))?;
    // In the machine's order of bytes.
    let own = array.getattr("dtype")?.call_method1("newbyteorder", ("=",))?;
    let array = asarray.call1((array, own))?.cast_into::<PyUntypedArray>()?;
    let values = None
        .or_else(|| copied(&array).map(Values::F32))
        .or_else(|| copied(&array).map(Values::F64))
        .or_else(|| copied(&array).map(Values::I64))
        .or_else(|| copied(&array).map(Values::I32));
    let values = match values {
        Some(values) => values,
        None => Values::Other(array.dtype().str()?.to_string()),
    };
    Ok(Tensor { shape: array.shape().to_vec(), values })
}

/// Returns the elements in row-major order, if they are of this type.
fn copied<T: Element + Copy>(array: &Bound<'_, PyUntypedArray>) -> Option<Vec<T>> {
    let array = array.cast::<PyArrayDyn<T>>().ok()?.try_readonly().ok()?;
    Some(array.as_array().iter().copied().collect())
}
