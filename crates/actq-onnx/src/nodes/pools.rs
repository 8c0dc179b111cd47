//! Pools over few positions: means and maxima over the places of a window.

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::arithmetic::two;
use crate::nodes::call::Call;
use crate::nodes::convolutions::{axes, window};
use crate::nodes::moves::transposed;
use crate::nodes::reductions::MAX_COMPARED;
use crate::values::expr::Exprs;
use crate::values::tensor::{Data, Element, Tensor, count, room};

/// Returns the output, if the node is a pool.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Option<Tensor>> {
    let op = match call.op() {
        "AveragePool" => "Add",
        "MaxPool" => "Max",
        _ => return Ok(None),
    };
    let x = call.input(0)?;
    let &[1, channels, ref lens @ ..] = &x.shape[..] else {
        bail!("reads the shape {:?}; export with [1, channel, ..]", x.shape)
    };
    let kernel: Option<Vec<usize>> = call.ints("kernel_shape").and_then(|ints| {
        let lens = ints.iter().map(|&n| usize::try_from(n).ok());
        lens.collect()
    });
    let kernel = kernel.filter(|kernel| kernel.len() == lens.len() && !kernel.is_empty());
    let kernel = kernel.with_context(|| format!("its kernel does not fit the shape {:?}", x.shape))?;
    let size = count(&kernel)?;
    ensure!(
        (1..=MAX_COMPARED).contains(&size),
        "has windows of {size} values; the limit is {MAX_COMPARED}; export the part after the encoder as a separate policy"
    );
    let axes = axes(call, lens, &kernel)?;
    ensure!(
        call.int("ceil_mode").unwrap_or(0) == 0 || axes.iter().all(|axis| axis.is_even()),
        "has a last window that extends past the end (ceil_mode); export with whole windows, or with padding"
    );
    let shape: Vec<usize> = axes.iter().map(|axis| axis.positions).collect();
    let positions = count(&shape)?;
    room(&[positions.saturating_mul(size), channels], most)?;
    let (elements, len) = (x.elements(), count(lens)?);
    let windows: Vec<Vec<Option<usize>>> = (0..positions).map(|position| window(&axes, position)).collect();
    // The elements at place k of every window. The channels of a position are adjacent, as in the output of the layer
    // before.
    let slice = |k: usize| -> Result<Tensor> {
        let mut slice = Vec::with_capacity(positions * channels);
        for window in &windows {
            // Padding is 0 in a sum. In a maximum it has no effect, so another element of the window replaces it.
            let place = if op == "Max" { window[k].or(window.iter().find_map(|place| *place)) } else { window[k] };
            ensure!(place.is_some() || op == "Add", "has a window of padding only; export with less padding");
            slice.extend(
                (0..channels).map(|channel| place.map_or(Element::Known(0.0), |at| elements[channel * len + at])),
            );
        }
        Ok(Tensor::of_elements(vec![positions, channels], slice))
    };
    let mut y = slice(0)?;
    for k in 1..size {
        y = two(op, exprs, &y, &slice(k)?, most)?;
    }
    if op == "Add" {
        let all = call.int("count_include_pad").unwrap_or(0) != 0;
        let counted = |window: &Vec<Option<usize>>| window.iter().filter(|place| all || place.is_some()).count();
        let shares = windows.iter().map(|window| 1.0 / counted(window).max(1) as f64).collect();
        y = two("Mul", exprs, &y, &Tensor::new(vec![positions, 1], Data::Real(shares)), most)?;
    }
    transposed(&y, &[1, 0])?.reshaped([vec![1, channels], shape].concat()).map(Some)
}
