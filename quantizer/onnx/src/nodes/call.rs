//! A node with what it reads: its inputs and attributes, each asked for by the name that ONNX gives it.

use actq::error::{Context as _, Result, bail};
use prost::bytes::Bytes;

use crate::file::model::Node;
use crate::values::tensor::Tensor;

/// What helps where an operation is not known.
pub(crate) const HELP: &str =
    "docs/IMPORT.md lists what is taken; actq import --output NAME makes a value before this node the action";

/// Why a random number is refused.
pub(crate) const RANDOM: &str =
    "draws random numbers; export the deterministic action, or name it with actq import --output NAME";

/// A node and its inputs.
#[derive(Clone, Copy)]
pub(crate) struct Call<'a> {
    pub(crate) node: &'a Node,
    /// `None`: left out.
    pub(crate) inputs: &'a [Option<&'a Tensor>],
}

impl<'a> Call<'a> {
    pub(crate) fn op(&self) -> &'a str {
        &self.node.op
    }

    /// Input `i`, which must be there.
    pub(crate) fn input(&self, i: usize) -> Result<&'a Tensor> {
        self.optional(i).with_context(|| format!("has no input {i}"))
    }

    pub(crate) fn optional(&self, i: usize) -> Option<&'a Tensor> {
        self.inputs.get(i).copied().flatten()
    }

    /// Input `i`, all of whose elements must be known; `what` names it.
    pub(crate) fn reals(&self, i: usize, what: &str) -> Result<Vec<f64>> {
        self.input(i)?.reals().with_context(|| format!("{what} depends on the observation; only a constant is taken"))
    }

    /// As [`Self::reals`], of integers.
    pub(crate) fn integers(&self, i: usize, what: &str) -> Result<Vec<i64>> {
        let tensor = self.input(i)?;
        let known = tensor.integers().map(<[i64]>::to_vec);
        known.with_context(|| {
            format!("{what} depends on the observation or is not of integers; export with fixed shapes")
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

    /// Integers that older operator sets have as an attribute and newer ones as input `i`.
    pub(crate) fn ints_or_input(&self, name: &str, i: usize) -> Result<Option<Vec<i64>>> {
        match (self.ints(name), self.optional(i)) {
            (Some(ints), _) => Ok(Some(ints)),
            (None, Some(_)) => self.integers(i, name).map(Some),
            (None, None) => Ok(None),
        }
    }

    /// The tensor of a Constant node.
    pub(crate) fn constant(&self) -> Result<Option<Bytes>> {
        if self.op() != "Constant" || !self.node.attributes.contains_key("value") {
            return Ok(None);
        }
        let tensor = self.node.attributes.get("value").and_then(|a| a.t.clone());
        tensor.context("its value is no tensor").map(Some)
    }

    /// The operation is not one that can be taken.
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
            | "DynamicQuantizeMatMul"
            | "MatMulNBits" => {
                bail!("the file is quantized already; export it in float32 and let actq quantize it")
            }
            "Loop" | "Scan" => bail!("runs a loop; export one step of the policy, unrolled"),
            "SequenceAt" | "SequenceConstruct" | "SplitToSequence" | "ConcatFromSequence" => {
                bail!("works on a list of tensors, as scripted modules do; export by tracing, or with dynamo=True")
            }
            "Attention" | "MultiHeadAttention" | "GroupQueryAttention" => {
                bail!("attention has no kernel here; export the part behind it as a policy of its own")
            }
            "ConvTranspose" => {
                bail!("has no kernel here; export the part behind the encoder as a policy of its own")
            }
            "Softmax" | "LogSoftmax" | "ArgMax" | "TopK" => {
                bail!(
                    "has no kernel here; where it only chooses among actions, actq import --output NAME takes the value before it"
                )
            }
            "GreaterOrEqual" | "Greater" | "Less" | "LessOrEqual" | "Equal" | "Not" | "And" | "Or" | "IsNaN"
            | "IsInf" => {
                bail!("compares with the observation; only comparisons of constants are taken; {HELP}")
            }
            _ if self.node.domain == "com.microsoft" => {
                bail!("is what onnxruntime's optimizer makes of several operations; import the file from before it")
            }
            _ => bail!("is not known; {HELP}"),
        }
    }
}
