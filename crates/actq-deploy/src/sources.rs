//! The files of a description: networks and arrays.

use actq::error::{Context as _, Result};
use actq::graph::Graph;
use actq::import::values::Tensor;
use actq::policy::Policy;

use crate::description::Network;

/// A network of a description, in f32.
pub trait Compute {
    /// Returns the graph's inputs that its outputs depend on, in the graph's order, with their lengths.
    fn inputs(&self) -> &[(String, usize)];

    /// Returns the graph's inputs that recurrent cells keep by themselves, from zero, with the outputs of their next
    /// values.
    fn states(&self) -> &[(String, String)] {
        &[]
    }

    /// Returns the lengths of the outputs that were asked for.
    fn outputs(&self) -> &[usize];

    /// Returns the part that computes an output; `None` if it cannot become an image.
    fn part(&self, _output: usize) -> Option<Part<'_>> {
        None
    }

    /// Forgets the recurrent state.
    fn reset(&mut self);

    /// Computes the outputs of a tick from the inputs.
    fn step(&mut self, inputs: &[Vec<f32>]) -> Vec<Vec<f32>>;
}

/// The part of a network that computes one of its outputs.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Its graph, and a contract of scales, offsets and limits after it.
    pub policy: &'a Policy,
    /// The graph with that contract as its last operations, for another network that reads the output.
    pub inner: &'a Graph,
    /// Numbers of the inputs that make its observation, one after the other.
    pub reads: &'a [usize],
}

/// An array of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Lengths of its axes.
    pub shape: Vec<usize>,
    /// Its values, the last axis the fastest.
    pub values: Vec<f64>,
}

impl Array {
    /// Takes an array of a file.
    ///
    /// # Errors
    ///
    /// If its elements are not numbers.
    pub fn of(tensor: Tensor) -> Result<Self> {
        let values = tensor.values.to_f64();
        let values = values.with_context(|| format!("it is of type {}; use numbers", tensor.values.type_name()))?;
        Ok(Self { shape: tensor.shape, values })
    }

    /// Returns the number of rows and their length; an array of one axis has rows of one value.
    ///
    /// # Errors
    ///
    /// If it has no axis.
    pub fn rows(&self) -> Result<(usize, usize)> {
        let (rows, row) = self.shape.split_first().ok_or_else(|| actq::error::Error::input("it has no axis"))?;
        Ok((*rows, row.iter().product()))
    }
}

/// Where a description's files come from.
pub trait Sources {
    /// Opens a network with some of its outputs.
    ///
    /// # Errors
    ///
    /// If the file is missing or not supported, or has no such output.
    fn network(&self, network: &Network, outputs: &[String]) -> Result<Box<dyn Compute>>;

    /// Reads an array of a file.
    ///
    /// # Errors
    ///
    /// If the file is missing or damaged, or has no such array.
    fn array(&self, file: &str, name: &str) -> Result<Array>;
}
