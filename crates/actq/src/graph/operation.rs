//! The interface of an operation. Each operation implements it in its own file in [`super::ops`].

use std::ops::Range;

use ndarray::{Array2, ArrayView1, ArrayView2};

use super::arrays::round_rows;
use super::lowering::{BufferId, Lowering};
use super::matrix::{Factors, Matrix};
use super::syntax::Syntax;
use super::units::keep;
use super::values::{ValueId, WeightMatrix};
use crate::error::{Result, ensure};
use crate::gemm::Panels;

/// A matrix product inside an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Product {
    /// Index in the graph's matrices.
    pub matrix: usize,
    /// Index in [`Operation::vectors`] of the vector that is added to the product; a constant part of its error can go
    /// there.
    pub bias: usize,
    /// Operand of the matrix.
    pub operand: Operand,
}

/// Operand of a product's matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// The node's input, which the node reads through such products only.
    Input,
    /// The node's hidden state.
    State,
}

/// Origin of the elements of an operation's output. It decides which elements of a network can only be removed together
/// ([`super::ties`]).
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Elements {
    /// Each from the rows of the products' matrices; without products, from constants.
    Own,
    /// Each from those at its place in the inputs.
    Inputs,
    /// These parts of the inputs, one after the other.
    Parts(Vec<Range<usize>>),
    /// Each from those of its head in the input, `[.., head, element]` with this many elements: only whole heads can be
    /// removed.
    Heads(usize),
    /// From attention, with these heads of queries and of keys, and elements of a head: inputs are `[token, head, element]`
    /// of queries, keys and values.
    Attention([usize; 3]),
    /// Together from outside the network, or from all elements of the inputs: neither they nor those can be removed.
    Whole,
}

/// Hidden and cell state of a node, `[sample, element]`; without elements if it has none.
pub type NodeState = [Array2<f32>; 2];

/// Values that a node keeps from a forward pass for the backward pass.
#[derive(Debug, Default)]
pub struct Saved {
    /// Operand of each of [`Operation::products`].
    pub operands: Vec<Array2<f32>>,
    /// Other values of the operation.
    pub inner: Vec<Array2<f32>>,
}

/// An operation: its computation forwards and backwards, and its form in an image.
pub trait Operation {
    /// Returns the length of the output for inputs of these lengths. An error names what does not fit.
    fn output_len(&self, matrices: &[WeightMatrix], inputs: &[usize]) -> Result<usize>;

    /// Returns the ops of policy.json that become this operation; none if only this library adds it.
    fn syntax() -> Vec<Syntax<Self>>
    where
        Self: Sized,
    {
        Vec::new()
    }

    /// Returns the matrix products.
    fn products(&self) -> Vec<Product> {
        Vec::new()
    }

    /// Returns the indices of its matrices, for a graph that has others before them.
    fn matrices_mut(&mut self) -> Vec<&mut usize> {
        Vec::new()
    }

    /// Returns the values that can be learned beside the matrices.
    fn vectors(&self) -> Vec<&Vec<f32>> {
        Vec::new()
    }

    /// As [`Self::vectors`].
    fn vectors_mut(&mut self) -> Vec<&mut Vec<f32>> {
        Vec::new()
    }

    /// Returns the number of trained values beside the matrices, as the f32 policy stores them.
    fn trained_values(&self) -> usize {
        self.vectors().into_iter().map(Vec::len).sum()
    }

    /// Returns the lengths of the hidden and of the cell state; 0 for none.
    fn state_lens(&self) -> [usize; 2] {
        [0, 0]
    }

    /// Returns what the elements of its output come from.
    fn elements(&self) -> Elements {
        if self.products().is_empty() { Elements::Inputs } else { Elements::Own }
    }

    /// Keeps some elements of the output, in this order, and the values of the vectors for them; of a recurrent cell
    /// its hidden units. There are `len` of them. The caller cuts the matrices: their rows as `unit_rows` (`units.rs`)
    /// says, and the columns of those that read the elements.
    fn keep_units(&mut self, len: usize, units: &[usize]) {
        self.vectors_mut().into_iter().for_each(|vector| keep(vector, len, units));
    }

    /// Computes the output for a batch, or for a sequence of batches. A node with a state has one row of it for each
    /// row of a batch, and `state` advances through the sequence.
    fn forward(&self, run: &Forward<'_>, state: &mut NodeState) -> (Array2<f32>, Saved);

    /// Goes from the derivative `dy` of the loss by the output to those by the inputs and weights, which `run`
    /// receives. `d_state`, the derivative by the state after the step, becomes that by the state before it.
    fn backward(&self, run: &mut Backward<'_>, saved: Saved, dy: Array2<f32>, d_state: &mut NodeState);

    /// Appends those of its operations that only need values up to `last`, before the first denoising step. Returns the
    /// inputs that [`Self::lower`] reads in the steps.
    fn prepare(&self, _to: &mut Lowering, inputs: &[ValueId], _last: ValueId) -> Vec<ValueId> {
        inputs.to_vec()
    }

    /// Appends its operations over the values `inputs`, and returns the buffer that then holds its output of `len`
    /// values.
    fn lower(&self, to: &mut Lowering, inputs: &[ValueId], len: usize) -> BufferId;
}

/// Returns the length of an operation's only input.
pub fn only(inputs: &[usize]) -> Result<usize> {
    ensure!(inputs.len() == 1, "takes one input, not {}", inputs.len());
    Ok(inputs[0])
}

/// Checks that the vector `what` has `len` values.
pub fn expect_len(what: &str, values: &[f32], len: usize) -> Result<()> {
    ensure!(values.len() == len, "{what} has {} values, but {len} are needed", values.len());
    Ok(())
}

/// Checks that matrix `index` exists, takes `cols` values and gives `rows`, if given; returns its rows.
pub fn expect_shape(matrices: &[WeightMatrix], index: usize, rows: Option<usize>, cols: usize) -> Result<usize> {
    ensure!(index < matrices.len(), "the network has no matrix {index}");
    let WeightMatrix { name, rows: r, cols: c, .. } = &matrices[index];
    ensure!(*c == cols, "the matrix {name:?} takes {c} values, but its operand has {cols}");
    let wanted = rows.unwrap_or(*r);
    ensure!(wanted == *r, "the matrix {name:?} gives {r} values, but {wanted} are needed");
    Ok(*r)
}

/// Values of a pass: those of the nodes that run once, then those of a denoising step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<'a> {
    pub(super) once: &'a [Array2<f32>],
    pub(super) of_step: &'a [Array2<f32>],
}

impl<'a> Values<'a> {
    pub(super) fn of(&self, value: ValueId) -> &'a Array2<f32> {
        self.once.get(value).unwrap_or_else(|| &self.of_step[value - self.once.len()])
    }
}

/// Context of a node in a forward pass.
#[derive(Debug)]
pub struct Forward<'a> {
    /// Every value so far.
    pub(super) values: Values<'a>,
    /// Indices of the node's inputs.
    pub(super) inputs: &'a [ValueId],
    /// The graph's matrices.
    pub(super) matrices: &'a [Matrix],
    /// As [`Operation::vectors`].
    pub vectors: &'a [Vec<f32>],
    /// Value that the network reads of the iterate; `None` outside of denoising steps.
    pub(super) iterate: Option<&'a Array2<f32>>,
    /// Number of the denoising step; 0 outside of them.
    pub step: usize,
    /// Activation magnitude of every matrix; empty: activations are not rounded.
    pub(super) x_max: &'a [u16],
}

impl<'a> Forward<'a> {
    /// Returns an input, `[sample, element]`.
    pub fn input(&self, i: usize) -> &'a Array2<f32> {
        self.values.of(self.inputs[i])
    }

    /// Returns all inputs.
    pub fn inputs(&self) -> impl Iterator<Item = &'a Array2<f32>> {
        let values = self.values;
        self.inputs.iter().map(move |&value| values.of(value))
    }

    /// Returns the rows of every value.
    pub fn samples(&self) -> usize {
        self.values.of(0).nrows()
    }

    /// Returns the value that the network reads of the iterate.
    pub fn iterate(&self) -> &'a Array2<f32> {
        self.iterate.unwrap_or(self.values.of(0))
    }

    /// Returns `true` if the image's activations are rounded.
    pub fn is_rounded(&self) -> bool {
        self.x_max.iter().any(|x_max| *x_max > 0)
    }

    /// Returns `x` as it enters the product with a matrix: rounded if the image's activations are.
    pub fn operand(&self, matrix: usize, x: ArrayView2<'_, f32>) -> Array2<f32> {
        round_rows(x, self.x_max.get(matrix).copied().unwrap_or(0))
    }

    /// Computes `W x` plus a vector.
    pub fn affine(&self, matrix: usize, x: &Array2<f32>, vector: usize) -> Array2<f32> {
        let mut y = Array2::zeros((x.nrows(), self.vectors[vector].len()));
        y += &ArrayView1::from(&self.vectors[vector]);
        self.matrices[matrix].add_product(x, y.view_mut());
        y
    }

    /// Returns a matrix, for products with a state.
    pub fn matrix(&self, matrix: usize) -> &'a Matrix {
        &self.matrices[matrix]
    }
}

/// Context of a node in a backward pass, and the destination of derivatives.
pub struct Backward<'a> {
    /// Index of the node.
    pub(super) node: usize,
    /// Every value of the forward pass.
    pub(super) values: Values<'a>,
    /// Indices of the node's inputs.
    pub(super) inputs: &'a [ValueId],
    /// The graph's matrices.
    pub(super) matrices: &'a [Matrix],
    /// As [`Operation::vectors`].
    pub vectors: &'a [Vec<f32>],
    /// Number of the denoising step.
    pub step: usize,
    /// Derivative by the value that the network reads of the iterate.
    pub(super) d_iterate: &'a mut Option<Array2<f32>>,
    /// Derivatives by all values, as far as they are known.
    pub(super) d_values: &'a mut [Option<Array2<f32>>],
    /// Derivatives by [`Operation::vectors`]; nodes add to them.
    pub d_vectors: &'a mut [Vec<f32>],
    /// Factors of the derivatives by the matrices.
    pub(super) products: &'a mut Vec<Factors>,
}

impl<'a> Backward<'a> {
    /// Returns an input, `[sample, element]`.
    pub fn input(&self, i: usize) -> &'a Array2<f32> {
        self.values.of(self.inputs[i])
    }

    /// Returns all inputs.
    pub fn inputs(&self) -> impl Iterator<Item = &'a Array2<f32>> + use<'a> {
        let values = self.values;
        self.inputs.iter().map(move |&value| values.of(value))
    }

    /// Returns the node's output.
    pub fn output(&self) -> &'a Array2<f32> {
        self.values.of(self.node + 1)
    }

    /// Adds the derivative by the value that the network reads of the iterate.
    pub fn give_iterate(&mut self, d: Array2<f32>) {
        match &mut *self.d_iterate {
            Some(sum) => *sum += &d,
            none => *none = Some(d),
        }
    }

    /// Adds the derivative by an input.
    pub fn give(&mut self, i: usize, d: Array2<f32>) {
        match &mut self.d_values[self.inputs[i]] {
            Some(sum) => *sum += &d,
            none => *none = Some(d),
        }
    }

    /// Receives the derivative `dy` by the output of a product, whose operand was `x`.
    pub fn product(&mut self, matrix: usize, x: Array2<f32>, dy: Array2<f32>) {
        self.products.push(Factors { matrix, x, dy });
    }

    /// Returns a matrix for products with derivatives by its output, which give those by its operand.
    pub(super) fn back(&self, matrix: usize) -> &'a Panels {
        self.matrices[matrix].back()
    }

    /// Gives the derivative by a matrix's operand to an input. The observation's derivative is never needed.
    pub fn give_through(&mut self, i: usize, matrix: usize, dy: &Array2<f32>) {
        if self.inputs[i] != 0 {
            self.give(i, self.back(matrix).product(dy.view()));
        }
    }
}
