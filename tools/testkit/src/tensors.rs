//! Files of tensors.

use safetensors::tensor::{Dtype, TensorView, serialize};

/// Returns a .safetensors file of tensors: name, type, shape and bytes.
///
/// # Panics
/// If the bytes of a tensor do not fit its shape.
pub fn safetensors<N: AsRef<str>, S: AsRef<[usize]>>(
    tensors: impl IntoIterator<Item = (N, Dtype, S, Vec<u8>)>,
) -> Vec<u8> {
    let tensors: Vec<_> = tensors.into_iter().collect();
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        let view = TensorView::new(*dtype, shape.as_ref().to_vec(), bytes);
        (name.as_ref(), view.expect("bytes that fit the shape"))
    });
    serialize(views, None).expect("a file of tensors")
}

/// Returns a .safetensors file of tensors of f32: name, shape and values.
///
/// # Panics
/// If the values of a tensor do not fit its shape.
pub fn f32_tensors<N: AsRef<str>, S: AsRef<[usize]>, V: AsRef<[f32]>>(
    tensors: impl IntoIterator<Item = (N, S, V)>,
) -> Vec<u8> {
    let bytes = |values: V| values.as_ref().iter().flat_map(|value| value.to_le_bytes()).collect();
    safetensors(tensors.into_iter().map(|(name, shape, values)| (name, Dtype::F32, shape, bytes(values))))
}
