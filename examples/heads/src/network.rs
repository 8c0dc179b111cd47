//! Ops of policy.json with their tensors.

use actq::random::Random;
use anyhow::Result;
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};
use serde_json::{Value, json};

/// The tensors of a network under construction.
pub(crate) struct Network {
    tensors: Vec<(String, Vec<usize>, Vec<f32>)>,
    random: Random,
}

impl Network {
    pub(crate) fn new() -> Self {
        Self { tensors: Vec::new(), random: Random::new(1) }
    }

    /// Adds a tensor of standard normal values times `by`.
    pub(crate) fn normal(&mut self, name: &str, shape: &[usize], by: f32) {
        let values = (0..shape.iter().product()).map(|_| by * self.random.normal()).collect();
        self.tensors.push((name.to_owned(), shape.to_vec(), values));
    }

    /// Adds a matrix that keeps the variance of its input, and biases.
    pub(crate) fn linear(&mut self, name: &str, rows: usize, cols: usize) -> Value {
        let [w, b] = ["weight", "bias"].map(|part| format!("{name}.{part}"));
        self.normal(&w, &[rows, cols], (cols as f32).recip().sqrt());
        self.normal(&b, &[rows], 0.1);
        json!({"op": "linear", "w": w, "b": b})
    }

    /// Adds a norm with its initial values.
    pub(crate) fn layernorm(&mut self, name: &str, len: usize, eps: f64) -> Value {
        let [w, b] = ["weight", "bias"].map(|part| format!("{name}.{part}"));
        self.tensors.push((w.clone(), vec![len], vec![1.0; len]));
        self.tensors.push((b.clone(), vec![len], vec![0.0; len]));
        json!({"op": "layernorm", "w_ln": w, "b_ln": b, "eps": eps})
    }

    pub(crate) fn safetensors(&self) -> Result<Vec<u8>> {
        let bytes: Vec<Vec<u8>> =
            self.tensors.iter().map(|(.., values)| values.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
        let views = self
            .tensors
            .iter()
            .zip(&bytes)
            .map(|((name, shape, _), bytes)| Ok((name, TensorView::new(Dtype::F32, shape.clone(), bytes)?)));
        Ok(serialize(views.collect::<Result<Vec<_>>>()?, None)?)
    }
}

/// Returns the op with one more key.
pub(crate) fn with(mut op: Value, key: &str, value: impl Into<Value>) -> Value {
    op[key] = value.into();
    op
}
