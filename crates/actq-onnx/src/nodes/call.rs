//! A node with its inputs and attributes, by ONNX's names.

use actq::error::{Context as _, Result, bail};
use prost::bytes::Bytes;

use crate::file::model::Node;
use crate::values::tensor::Tensor;

/// Remedy for an operator that is not supported.
pub(crate) const HELP: &str =
    "docs/IMPORT.md lists the supported operators; actq import --output NAME makes a value before this node the action";

/// Error of an operator that draws random numbers.
const RANDOM: &str = "draws random numbers; export the deterministic action, or choose it by actq import --output NAME";

/// A node and its inputs.
#[derive(Clone, Copy)]
pub(crate) struct Call<'a> {
    pub(crate) node: &'a Node,
    /// The inputs; `None` for an omitted one.
    pub(crate) inputs: &'a [Option<&'a Tensor>],
    /// Version of ONNX's own operators that the file declares.
    pub(crate) opset: i64,
}

impl<'a> Call<'a> {
    pub(crate) fn op(&self) -> &'a str {
        &self.node.op
    }

    /// Returns input `i`, which must be present.
    pub(crate) fn input(&self, i: usize) -> Result<&'a Tensor> {
        self.optional(i).with_context(|| format!("has no input {i}"))
    }

    pub(crate) fn optional(&self, i: usize) -> Option<&'a Tensor> {
        self.inputs.get(i).copied().flatten()
    }

    /// Returns input `i`, which must be a known tensor; `what` names it in the error.
    pub(crate) fn reals(&self, i: usize, what: &str) -> Result<Vec<f64>> {
        self.input(i)?.reals().with_context(|| format!("{what} depends on the observation; it must be a constant"))
    }

    /// Returns the same as [`Self::reals`], for integers.
    pub(crate) fn integers(&self, i: usize, what: &str) -> Result<Vec<i64>> {
        let tensor = self.input(i)?;
        let known = tensor.integers().map(<[i64]>::to_vec);
        known.with_context(|| {
            format!("{what} depends on the observation or is not an integer; export with fixed shapes")
        })
    }

    pub(crate) fn int(&self, name: &str) -> Option<i64> {
        self.node.attributes.get(name).and_then(|a| a.i)
    }

    pub(crate) fn float(&self, name: &str) -> Option<f64> {
        self.node.attributes.get(name).and_then(|a| a.f).map(f64::from)
    }

    pub(crate) fn ints(&self, name: &str) -> Option<Vec<i64>> {
        self.node.attributes.get(name).map(|a| a.ints.clone())
    }

    pub(crate) fn text(&self, name: &str) -> Option<String> {
        let text = self.node.attributes.get(name).and_then(|a| a.s.as_ref());
        text.map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }

    /// Returns integers that older operator sets have as an attribute and newer ones as input `i`.
    pub(crate) fn ints_or_input(&self, name: &str, i: usize) -> Result<Option<Vec<i64>>> {
        match (self.ints(name), self.optional(i)) {
            (Some(ints), _) => Ok(Some(ints)),
            (None, Some(_)) => self.integers(i, name).map(Some),
            (None, None) => Ok(None),
        }
    }

    /// Returns the tensor of a Constant node.
    pub(crate) fn constant(&self) -> Result<Option<Bytes>> {
        if self.op() != "Constant" || !self.node.attributes.contains_key("value") {
            return Ok(None);
        }
        let tensor = self.node.attributes.get("value").and_then(|a| a.t.clone());
        tensor.context("its value is not a tensor").map(Some)
    }

    /// Fails for an operator that is not supported, with its remedy.
    pub(crate) fn refuse<T>(&self) -> Result<T> {
        match self.op() {
            "RandomNormal" | "RandomNormalLike" | "RandomUniform" | "RandomUniformLike" | "Multinomial"
            | "Bernoulli" => bail!("{RANDOM}"),
            "QuantizeLinear"
            | "DequantizeLinear"
            | "DynamicQuantizeLinear"
            | "MatMulInteger"
            | "ConvInteger"
            | "QLinearMatMul"
            | "QLinearConv"
            | "QGemm"
            | "DynamicQuantizeMatMul" => {
                bail!("the file is already quantized; export it in float32 and quantize it by actq")
            }
            "MatMulNBits" => {
                bail!(
                    "the file is already quantized; export it in float32, or with QuantFormat.QDQ, and quantize it by actq"
                )
            }
            "Loop" | "Scan" => bail!("runs a loop; export one step of the policy, unrolled"),
            "SequenceAt" | "SequenceConstruct" | "SplitToSequence" | "ConcatFromSequence" => {
                bail!("works on a list of tensors, as scripted modules do; export by tracing, or with dynamo=True")
            }
            "ConvTranspose" => {
                bail!("has no kernel here; export the part after the encoder as a separate policy")
            }
            "LogSoftmax" | "ArgMax" | "TopK" => {
                bail!(
                    "has no kernel here; if it only chooses among actions, pass the value before it to actq import --output NAME"
                )
            }
            "GreaterOrEqual" | "Greater" | "Less" | "LessOrEqual" | "Equal" | "Not" | "And" | "Or" | "IsNaN"
            | "IsInf" => {
                bail!("compares the observation, and only constants can be compared; {HELP}")
            }
            _ if self.node.domain == "com.microsoft" => {
                bail!("is an operator of onnxruntime's optimizer; import the file from before the optimizer")
            }
            _ => bail!("is not a supported operator; {HELP}"),
        }
    }
}
