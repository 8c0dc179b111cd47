//! Convolutions over few positions, as in encoders of histories, with a matrix product for each position and group.

use std::sync::Arc;

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::arithmetic::two;
use crate::nodes::call::Call;
use crate::nodes::moves::transposed;
use crate::nodes::products::row_product;
use crate::values::expr::{Exprs, Matrix};
use crate::values::tensor::{Data, Element, Tensor, count};

/// The most positions times groups, each of which is an operation in the image.
const MAX_PRODUCTS: usize = 64;

/// An axis that the kernel moves along.
pub(crate) struct Axis {
    /// Length of the operand.
    len: usize,
    /// Length of the kernel.
    kernel: usize,
    stride: usize,
    dilation: usize,
    /// Zeros before the operand.
    pad: usize,
    /// Number of positions of the kernel.
    pub(crate) positions: usize,
    /// Values after the last position that the kernel does not reach.
    rest: usize,
}

impl Axis {
    /// Returns `true` if the last position ends with the operand and its padding.
    pub(crate) fn is_even(&self) -> bool {
        self.rest == 0
    }
}

/// Returns the output, if the node is a convolution.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Option<Tensor>> {
    if call.op() != "Conv" {
        return Ok(None);
    }
    let (x, w) = (call.input(0)?, call.input(1)?);
    let weights = call.reals(1, "the kernel")?;
    let (&[1, channels, ref lens @ ..], &[outputs, inputs, ref kernel @ ..]) = (&x.shape[..], &w.shape[..]) else {
        bail!("reads the shape {:?} with a kernel of {:?}; export with [1, channel, ..]", x.shape, w.shape)
    };
    let groups = usize::try_from(call.int("group").unwrap_or(1)).unwrap_or(0);
    let fits =
        groups > 0 && channels == inputs * groups && outputs.is_multiple_of(groups) && lens.len() == kernel.len();
    ensure!(
        fits && x.len() > 0 && w.len() > 0,
        "reads the shape {:?} with a kernel of {:?} in {groups} groups, which do not fit",
        x.shape,
        w.shape
    );
    let axes = axes(call, lens, kernel)?;
    let shape: Vec<usize> = axes.iter().map(|axis| axis.positions).collect();
    let positions = count(&shape)?;
    ensure!(
        (1..=MAX_PRODUCTS).contains(&positions.saturating_mul(groups)),
        "has {positions} positions with {groups} groups; the limit of positions times groups is {MAX_PRODUCTS}; export the part \
         after the encoder as a separate policy"
    );
    let (rows, cols, size) = (outputs / groups, w.len() / outputs, count(kernel)?);
    let matrix = |(g, data): (usize, &[f64])| {
        let name = w.name.as_ref().map(|name| if groups == 1 { name.clone() } else { format!("{name}.{g}") });
        // The channels of one place are adjacent, as in the output of the layer before.
        let turned = (0..rows * cols).map(|i| data[i / cols * cols + i % inputs * size + i % cols / inputs]).collect();
        Arc::new(Matrix { name, rows, cols, data: turned })
    };
    let matrices: Vec<Arc<Matrix>> = weights.chunks(rows * cols).enumerate().map(matrix).collect();
    let elements = x.elements();
    let len = count(lens)?;
    let mut all = Vec::with_capacity(positions * outputs);
    for position in 0..positions {
        let places = window(&axes, position);
        for (g, matrix) in matrices.iter().enumerate() {
            let channels_at = |place: &Option<usize>| -> Vec<Element> {
                let of = |channel: usize| place.map_or(Element::Known(0.0), |at| elements[channel * len + at]);
                (g * inputs..(g + 1) * inputs).map(of).collect()
            };
            let operand: Vec<Element> = places.iter().flat_map(channels_at).collect();
            all.extend(row_product(exprs, &operand, matrix, budget)?);
        }
    }
    let mut y = Tensor::of_elements(vec![positions, outputs], all);
    if call.optional(2).is_some() {
        let bias = call.reals(2, "the bias")?;
        ensure!(bias.len() == outputs, "its bias has {} values for {outputs} channels", bias.len());
        y = two("Add", exprs, &y, &Tensor::new(vec![outputs], Data::Real(bias)), y.len())?;
    }
    transposed(&y, &[1, 0])?.reshaped([vec![1, outputs], shape].concat()).map(Some)
}

/// Returns the axes of a kernel over an operand, from their lengths and the node's attributes.
pub(crate) fn axes(call: &Call<'_>, lens: &[usize], kernel: &[usize]) -> Result<Vec<Axis>> {
    let n = lens.len();
    let list = |name: &str, count: usize, default: usize| -> Result<Vec<usize>> {
        let Some(given) = call.ints(name) else { return Ok(vec![default; count]) };
        let given: Option<Vec<usize>> = given.iter().map(|&v| usize::try_from(v).ok()).collect();
        given
            .filter(|given| given.len() == count)
            .with_context(|| format!("its attribute {name} does not fit {n} axes"))
    };
    let (strides, dilations, pads) = (list("strides", n, 1)?, list("dilations", n, 1)?, list("pads", 2 * n, 0)?);
    let auto = call.text("auto_pad").unwrap_or_default();
    let one = |i: usize| {
        let (len, kernel, stride, dilation) = (lens[i], kernel[i], strides[i], dilations[i]);
        ensure!(stride > 0 && dilation > 0 && kernel > 0, "has a stride, a dilation or a kernel of 0");
        let reach = dilation.saturating_mul(kernel - 1).saturating_add(1);
        let (before, after) = match auto.as_str() {
            "SAME_UPPER" | "SAME_LOWER" => {
                let both = (len.div_ceil(stride) - 1).saturating_mul(stride).saturating_add(reach).saturating_sub(len);
                let less = both / 2;
                if auto == "SAME_UPPER" { (less, both - less) } else { (both - less, less) }
            }
            _ => (pads[i], pads[n + i]),
        };
        let whole = len.saturating_add(before).saturating_add(after);
        ensure!(reach <= whole, "its kernel spans {reach} values of {whole}; add padding");
        let (steps, rest) = ((whole - reach) / stride, (whole - reach) % stride);
        Ok(Axis { len, kernel, stride, dilation, pad: before, positions: steps + 1, rest })
    };
    (0..n).map(one).collect()
}

/// Lists the places of a channel that the kernel covers at a position; `None` is padding.
pub(crate) fn window(axes: &[Axis], position: usize) -> Vec<Option<usize>> {
    // The position along each axis, the last one first.
    let mut left = position;
    let mut starts: Vec<usize> = Vec::with_capacity(axes.len());
    for axis in axes.iter().rev() {
        starts.push(left % axis.positions * axis.stride);
        left /= axis.positions;
    }
    let mut places = vec![Some(0)];
    for (axis, start) in axes.iter().zip(starts.into_iter().rev()) {
        let along = |k: usize| (start + k * axis.dilation).checked_sub(axis.pad).filter(|at| *at < axis.len);
        let next = |place: Option<usize>| (0..axis.kernel).map(move |k| Some(place? * axis.len + along(k)?));
        places = places.into_iter().flat_map(next).collect();
    }
    places
}
