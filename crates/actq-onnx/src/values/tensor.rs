//! Tensors of the graph: of known numbers, or of elements of the network's values.

use actq::error::{Result, ensure};

use crate::values::expr::Id;

/// An element of a tensor with at least one element that is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Element {
    /// Element of this index of a value.
    Of(Id, usize),
    /// A known number.
    Known(f64),
}

/// Elements, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Data {
    /// Known real numbers.
    Real(Vec<f64>),
    /// Known integers, and booleans as 0 and 1.
    Int(Vec<i64>),
    /// At least one element is not known before the network runs.
    Open(Vec<Element>),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tensor {
    /// Length of each axis.
    pub(crate) shape: Vec<usize>,
    pub(crate) data: Data,
    /// The initializer's name, while the elements are unchanged.
    pub(crate) name: Option<String>,
}

/// The most elements of a tensor, with empty axes counted as 1. It bounds the work along an axis.
const MAX_ELEMENTS: usize = 1 << 28;

/// Returns the number of elements of a shape.
pub(crate) fn count(shape: &[usize]) -> Result<usize> {
    let product = shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d.max(1)).filter(|&n| n <= MAX_ELEMENTS));
    let empty = shape.contains(&0);
    let fits = product.filter(|&n| !empty || n <= 1 << 16);
    ensure!(fits.is_some(), "shape {shape:?} exceeds the limit of a tensor's elements");
    Ok(fits.filter(|_| !empty).unwrap_or_default())
}

/// Returns the number of elements of a result's shape; fails above `most`.
pub(crate) fn room(shape: &[usize], most: usize) -> Result<usize> {
    let n = count(shape)?;
    ensure!(n <= most, "shape {shape:?} has more values than a policy of this size can have");
    Ok(n)
}

impl Tensor {
    pub(crate) fn new(shape: Vec<usize>, data: Data) -> Self {
        Self { shape, data, name: None }
    }

    /// Makes a tensor with one axis of integers.
    pub(crate) fn ints(values: Vec<i64>) -> Self {
        Self::new(vec![values.len()], Data::Int(values))
    }

    /// Makes a tensor of elements, of known numbers if all are known.
    pub(crate) fn of_elements(shape: Vec<usize>, elements: Vec<Element>) -> Self {
        let known = |e: &Element| match e {
            Element::Known(v) => Some(*v),
            Element::Of(..) => None,
        };
        let numbers: Option<Vec<f64>> = elements.iter().map(known).collect();
        Self::new(shape, numbers.map_or(Data::Open(elements), Data::Real))
    }

    pub(crate) fn len(&self) -> usize {
        match &self.data {
            Data::Real(v) => v.len(),
            Data::Int(v) => v.len(),
            Data::Open(v) => v.len(),
        }
    }

    pub(crate) fn is_known(&self) -> bool {
        !matches!(self.data, Data::Open(_))
    }

    pub(crate) fn elements(&self) -> Vec<Element> {
        match &self.data {
            Data::Real(v) => v.iter().map(|&v| Element::Known(v)).collect(),
            Data::Int(v) => v.iter().map(|&v| Element::Known(v as f64)).collect(),
            Data::Open(v) => v.clone(),
        }
    }

    /// Returns the numbers of a known tensor.
    pub(crate) fn reals(&self) -> Option<Vec<f64>> {
        match &self.data {
            Data::Real(v) => Some(v.clone()),
            Data::Int(v) => Some(v.iter().map(|&v| v as f64).collect()),
            Data::Open(_) => None,
        }
    }

    /// Returns the integers of a known tensor of integers.
    pub(crate) fn integers(&self) -> Option<&[i64]> {
        if let Data::Int(v) = &self.data { Some(v) } else { None }
    }

    /// Returns the elements of several tensors one after the other.
    pub(crate) fn chain(parts: &[&Self]) -> Self {
        let ints: Option<Vec<&[i64]>> = parts.iter().map(|part| part.integers()).collect();
        match ints {
            Some(ints) => Self::ints(ints.concat()),
            None => {
                let elements: Vec<Element> = parts.iter().flat_map(|part| part.elements()).collect();
                Self::of_elements(vec![elements.len()], elements)
            }
        }
    }

    /// Returns the same elements in another shape.
    pub(crate) fn reshaped(&self, shape: Vec<usize>) -> Result<Self> {
        ensure!(count(&shape)? == self.len(), "shape {:?} cannot be reshaped to {shape:?}", self.shape);
        Ok(Self { shape, ..self.clone() })
    }

    /// Returns the elements at these places.
    pub(crate) fn taken(&self, shape: Vec<usize>, places: &[usize]) -> Result<Self> {
        fn pick<T: Copy>(from: &[T], places: &[usize]) -> Option<Vec<T>> {
            places.iter().map(|&i| from.get(i).copied()).collect()
        }
        let data = match &self.data {
            Data::Real(v) => pick(v, places).map(Data::Real),
            Data::Int(v) => pick(v, places).map(Data::Int),
            Data::Open(v) => return Ok(Self::of_elements(shape, pick(v, places).unwrap_or_default())),
        };
        ensure!(data.is_some(), "a place is outside the tensor; internal error; please report it");
        Ok(Self::new(shape, data.unwrap_or(Data::Int(Vec::new()))))
    }
}
