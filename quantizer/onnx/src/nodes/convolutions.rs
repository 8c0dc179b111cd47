//! Convolutions over few positions, as encoders of histories have: a product for each position and group.

use std::sync::Arc;

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::arithmetic::two;
use crate::nodes::call::Call;
use crate::nodes::places::transpose;
use crate::nodes::products::row_product;
use crate::values::expr::{Exprs, Matrix};
use crate::values::tensor::{Data, Element, Tensor, count};

/// The most positions, each counted once for every group: the image has an operation for each.
const MOST_PRODUCTS: usize = 64;

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
    /// Of the kernel.
    pub(crate) positions: usize,
    /// Values behind the last position, which the kernel does not reach.
    rest: usize,
}

impl Axis {
    /// Whether the positions end with the operand and its padding.
    pub(crate) fn is_even(&self) -> bool {
        self.rest == 0
    }
}

/// The output, where the node is a convolution.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Option<Tensor>> {
    if call.op() != "Conv" {
        return Ok(None);
    }
    let (x, w) = (call.input(0)?, call.input(1)?);
    let weights = call.reals(1, "the kernel")?;
    let (&[1, channels, ref lens @ ..], &[outputs, inputs, ref kernel @ ..]) = (&x.shape[..], &w.shape[..]) else {
        bail!("takes {:?} with a kernel of {:?}; [1, channel, ..] is taken", x.shape, w.shape)
    };
    let groups = usize::try_from(call.int("group").unwrap_or(1)).unwrap_or(0);
    let fits =
        groups > 0 && channels == inputs * groups && outputs.is_multiple_of(groups) && lens.len() == kernel.len();
    ensure!(
        fits && x.len() > 0 && w.len() > 0,
        "takes {:?} with a kernel of {:?} in {groups} groups",
        x.shape,
        w.shape
    );
    let axes = axes(call, lens, kernel)?;
    let shape: Vec<usize> = axes.iter().map(|axis| axis.positions).collect();
    let positions = count(&shape)?;
    ensure!(
        (1..=MOST_PRODUCTS).contains(&positions.saturating_mul(groups)),
        "goes over {positions} positions with {groups} groups; 1 to {MOST_PRODUCTS} are taken, positions times groups; export the \
         part behind the encoder as a policy of its own"
    );
    let (rows, cols, size) = (outputs / groups, w.len() / outputs, count(kernel)?);
    let matrix = |(g, data): (usize, &[f64])| {
        let name = w.name.as_ref().map(|name| if groups == 1 { name.clone() } else { format!("{name}.{g}") });
        // All channels at one place stand together, as the layer before has given them.
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
            let seen = |place: &Option<usize>| -> Vec<Element> {
                let of = |channel: usize| place.map_or(Element::Known(0.0), |at| elements[channel * len + at]);
                (g * inputs..(g + 1) * inputs).map(of).collect()
            };
            let seen: Vec<Element> = places.iter().flat_map(seen).collect();
            all.extend(row_product(exprs, &seen, matrix, budget)?);
        }
    }
    let mut y = Tensor::of_elements(vec![positions, outputs], all);
    if call.optional(2).is_some() {
        let bias = call.reals(2, "the bias")?;
        ensure!(bias.len() == outputs, "its bias has {} values for {outputs} channels", bias.len());
        y = two("Add", exprs, &y, &Tensor::new(vec![outputs], Data::Real(bias)), y.len())?;
    }
    let (turned, places) = transpose(&y.shape, &[1, 0])?;
    y.taken(turned, &places)?.reshaped([vec![1, outputs], shape].concat()).map(Some)
}

/// The axes of a kernel of these lengths along operands of these, by the node's attributes.
pub(crate) fn axes(call: &Call<'_>, lens: &[usize], kernel: &[usize]) -> Result<Vec<Axis>> {
    let n = lens.len();
    let list = |name: &str, count: usize, default: usize| -> Result<Vec<usize>> {
        let Some(given) = call.ints(name) else { return Ok(vec![default; count]) };
        let given: Option<Vec<usize>> = given.iter().map(|&v| usize::try_from(v).ok()).collect();
        given.filter(|given| given.len() == count).with_context(|| format!("its {name} do not fit {n} axes"))
    };
    let (strides, dilations, pads) = (list("strides", n, 1)?, list("dilations", n, 1)?, list("pads", 2 * n, 0)?);
    let auto = call.text("auto_pad").unwrap_or_default();
    let one = |i: usize| {
        let (len, kernel, stride, dilation) = (lens[i], kernel[i], strides[i], dilations[i]);
        ensure!(stride > 0 && dilation > 0 && kernel > 0, "has a stride, a dilation or a kernel of 0");
        let reach = dilation.saturating_mul(kernel - 1).saturating_add(1);
        let (before, behind) = match auto.as_str() {
            "SAME_UPPER" | "SAME_LOWER" => {
                let both = (len.div_ceil(stride) - 1).saturating_mul(stride).saturating_add(reach).saturating_sub(len);
                let less = both / 2;
                if auto == "SAME_UPPER" { (less, both - less) } else { (both - less, less) }
            }
            _ => (pads[i], pads[n + i]),
        };
        let whole = len.saturating_add(before).saturating_add(behind);
        ensure!(reach <= whole, "its kernel reaches over {reach} of {whole} values");
        let (steps, rest) = ((whole - reach) / stride, (whole - reach) % stride);
        Ok(Axis { len, kernel, stride, dilation, pad: before, positions: steps + 1, rest })
    };
    (0..n).map(one).collect()
}

/// What the kernel sees at a position, as places of a channel; `None` is padding.
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
