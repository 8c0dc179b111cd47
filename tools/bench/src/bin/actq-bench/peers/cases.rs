//! The networks that all peers run.

use actq::emit;
use actq::graph::ops::{Gru, Linear, Pointwise};
use actq::methods::Activations;
use actq::random::Random;
use actq_bench::networks::Builder;
use actq_kernels::Width;
use actq_kernels::math::Function;
use anyhow::Result;
use serde::Serialize;

/// Steps of each program; the last one is counted.
pub(crate) const STEPS: usize = 3;
/// Inputs from which scales of int8 values are computed.
const CALIBRATION: usize = 256;

/// A network.
#[derive(Debug)]
pub(crate) struct Case {
    pub(crate) name: &'static str,
    /// Lengths of the values.
    pub(crate) lengths: &'static [usize],
    /// Function after each layer but the last; `None` for a GRU.
    pub(crate) function: Option<Function>,
}

/// The MLP has the lengths of a policy that walks a Go1.
const MLP: &[usize] = &[48, 512, 256, 128, 12];

/// The first one chooses the builds of the others.
pub(crate) const CASES: [Case; 4] = [
    Case { name: "mlp relu", lengths: MLP, function: Some(Function::Relu) },
    Case { name: "layer", lengths: &[256, 256], function: Some(Function::Relu) },
    Case { name: "mlp elu", lengths: MLP, function: Some(Function::Elu) },
    Case { name: "gru", lengths: &[48, 128], function: None },
];

/// Weights, row after row, and biases.
#[derive(Debug, Serialize)]
pub(crate) struct Product {
    weights: Vec<f32>,
    bias: Vec<f32>,
}

/// An image, with the numbers that its codes and scales mean.
#[derive(Debug)]
pub(crate) struct Quantized {
    pub(crate) image: Vec<u8>,
    pub(crate) products: Vec<Product>,
}

impl Case {
    pub(crate) fn inputs(&self) -> usize {
        self.lengths[0]
    }

    pub(crate) fn outputs(&self) -> usize {
        self.lengths[self.lengths.len() - 1]
    }

    pub(crate) fn macs(&self) -> usize {
        let [input, output] = [self.inputs(), self.outputs()];
        match self.function {
            None => 3 * output * (input + output),
            Some(_) => self.lengths.windows(2).map(|pair| pair[0] * pair[1]).sum(),
        }
    }

    /// Returns the function that follows layers.
    pub(crate) fn between_layers(&self) -> Option<Function> {
        self.function.filter(|_| self.lengths.len() > 2)
    }

    /// Returns the network with random weights, rounded to nearest with row scales, and int8 activations; and its f32
    /// original. Weights are the same for all widths.
    pub(crate) fn quantized(&self, width: Width) -> Result<(Quantized, Vec<Product>)> {
        let mut builder = Builder::new(self.inputs());
        let matrix = |builder: &mut Builder, rows: usize, cols: usize| -> Result<(usize, Vec<f32>)> {
            let matrix = builder.matrix(rows, cols, Activations::Int8, &vec![Some(width); rows], 0)?;
            Ok((matrix, builder.values(rows)))
        };
        let mut biases = Vec::new();
        if let Some(function) = self.function {
            let mut value = 0;
            for (i, pair) in self.lengths.windows(2).enumerate() {
                let (matrix, bias) = matrix(&mut builder, pair[1], pair[0])?;
                biases.push(bias.clone());
                value = builder.node(Linear { matrix, bias }, &[value])?;
                if i + 2 < self.lengths.len() {
                    value = builder.node(Pointwise(function), &[value])?;
                }
            }
        } else {
            let hidden = self.outputs();
            let (input, input_bias) = matrix(&mut builder, 3 * hidden, self.inputs())?;
            let (state, state_bias) = matrix(&mut builder, 3 * hidden, hidden)?;
            biases = vec![input_bias.clone(), state_bias.clone()];
            builder.node(Gru { hidden, input, state, input_bias, state_bias }, &[0])?;
        }
        let (policy, outcomes) = builder.finish("peers".to_owned(), false);
        let product = |weights: Vec<f32>, bias: &Vec<f32>| Product { weights, bias: bias.clone() };
        let original =
            policy.graph.matrices.iter().zip(&biases).map(|(matrix, bias)| product(matrix.data.clone(), bias));
        let original = original.collect();
        let image = emit::image(&policy, &outcomes)?;
        let products = outcomes.iter().zip(&biases).map(|(o, bias)| product(o.quantized.dequantized(), bias)).collect();
        Ok((Quantized { image, products }, original))
    }

    /// Returns the description for `prepare.py`: the network in f32 and at each width.
    pub(crate) fn description(&self, widths: &[Width]) -> Result<serde_json::Value> {
        let mut forms = serde_json::Map::new();
        for &width in widths {
            let (quantized, original) = self.quantized(width)?;
            forms.insert("f32".to_owned(), serde_json::to_value(original)?);
            forms.insert(format!("actq {}", width.bits()), serde_json::to_value(quantized.products)?);
        }
        let mut random = Random::new(7);
        let mut draw = |steps: usize| -> Vec<Vec<f32>> {
            (0..steps).map(|_| (0..self.inputs()).map(|_| random.unit()).collect()).collect()
        };
        let (inputs, mut calibration) = (draw(STEPS), draw(CALIBRATION));
        // Saturated values would be no fault of a peer.
        calibration.extend(inputs.iter().cloned());
        Ok(serde_json::json!({
            "forms": forms,
            "is_gru": self.function.is_none(),
            "function": self.function.map(Function::name),
            "inputs": inputs,
            "calibration": calibration,
        }))
    }
}
