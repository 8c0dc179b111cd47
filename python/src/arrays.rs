//! Arrays of numpy as the arrays of recordings.

use actq::import::values::{Tensor, Values};
use numpy::{AllowTypeChange, Element, PyArrayDyn, PyArrayLikeDyn};
use numpy::{PyArrayMethods as _, PyUntypedArray, PyUntypedArrayMethods as _};
use pyo3::prelude::*;

use crate::error::{given, of_python};

/// Returns what numpy makes an array of. A tensor of torch is read without its gradients, on the CPU, and as float32 if
/// its numbers are shorter: numpy has no bfloat16.
pub(crate) fn array<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let read = || {
        let mut object = object.clone();
        if object.hasattr("detach")? && object.hasattr("is_floating_point")? {
            object = object.call_method0("detach")?.call_method0("cpu")?;
            let is_float: bool = object.call_method0("is_floating_point")?.extract()?;
            if is_float && object.call_method0("element_size")?.extract::<usize>()? < size_of::<f32>() {
                object = object.call_method0("float")?;
            }
        }
        object.py().import("numpy")?.call_method1("asarray", (object,))
    };
    read().map_err(|error| of_python(object.py(), error))
}

/// Extracts an argument of numbers, converted to float32.
pub(crate) fn floats<'py>(object: &Bound<'py, PyAny>) -> PyResult<PyArrayLikeDyn<'py, f32, AllowTypeChange>> {
    given(&array(object)?)
}

/// Copies an array, or what numpy makes one of. Types that no recording has are passed on by their names only.
pub(crate) fn tensor(object: &Bound<'_, PyAny>) -> PyResult<Tensor> {
    let array = array(object)?;
    // In the machine's order of bytes.
    let own = array.getattr("dtype")?.call_method1("newbyteorder", ("=",))?;
    let array = array.call_method1("astype", (own,))?.cast_into::<PyUntypedArray>()?;
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
