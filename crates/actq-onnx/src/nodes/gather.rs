//! Operators that read or replace elements at known indices.

use actq::error::{Context as _, Result, ensure};

use crate::nodes::call::Call;
use crate::nodes::places::{along, axis};
use crate::values::tensor::{Tensor, count, room};

/// Gathers slices at known indices of an axis.
pub(crate) fn gather(call: &Call<'_>, most: usize) -> Result<Tensor> {
    let input = call.input(0)?;
    let at = axis(call.int("axis").unwrap_or(0), input.shape.len())?;
    let n = input.shape[at];
    let indices = call.integers(1, "the indices")?;
    let shape = &call.input(1)?.shape;
    let (before, after) = (&input.shape[..at], &input.shape[at + 1..]);
    let out = [before, shape, after].concat();
    room(&out, most)?;
    let chosen = indices.iter().map(|&i| axis(i, n)).collect::<Result<Vec<_>>>()?;
    let (_, found) = along(&input.shape, at, chosen)?;
    input.taken(out, &found)
}

/// Gathers slices at known places.
pub(crate) fn gather_nd(call: &Call<'_>, most: usize) -> Result<Tensor> {
    let input = call.input(0)?;
    let batch = call.int("batch_dims").and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
    let indices = call.integers(1, "the indices")?;
    let (depth, outer) = call.input(1)?.shape.split_last().context("its indices have no axis")?;
    let piece = batch
        .checked_add(*depth)
        .and_then(|n| input.shape.get(n..))
        .context("its indices have more parts than the input has axes")?;
    // Batch axes of length 1 have no effect.
    ensure!(
        *depth > 0 && input.shape[..batch].iter().all(|&n| n == 1),
        "reads several batches; export with a batch of 1"
    );
    let out = [outer, piece].concat();
    room(&out, most)?;
    let n = count(piece)?;
    let mut places = Vec::new();
    for index in indices.chunks(*depth) {
        let at = place(index, &input.shape[batch..])?;
        places.extend(at * n..(at + 1) * n);
    }
    input.taken(out, &places)
}

/// Returns the place of a slice with this index along the first axes of a shape.
fn place(index: &[i64], shape: &[usize]) -> Result<usize> {
    index.iter().zip(shape).try_fold(0, |at, (&i, &n)| Ok(at * n + axis(i, n)?))
}

fn refuse_reduction(call: &Call<'_>) -> Result<()> {
    ensure!(
        matches!(call.text("reduction").as_deref(), None | Some("none")),
        "has a reduction; only replacement is supported"
    );
    Ok(())
}

/// Replaces slices at known places.
pub(crate) fn scatter_nd(call: &Call<'_>) -> Result<Tensor> {
    let (data, updates) = (call.input(0)?, call.input(2)?);
    refuse_reduction(call)?;
    let indices = call.integers(1, "the indices")?;
    let depth = call.input(1)?.shape.last().copied().unwrap_or(1);
    ensure!((1..=data.shape.len()).contains(&depth), "its indices have {depth} parts for {} axes", data.shape.len());
    let piece = count(&data.shape[depth..])?;
    let rows = indices.chunks(depth);
    ensure!(updates.len() == rows.len() * piece, "its updates do not fit its indices");
    let mut places: Vec<usize> = (0..data.len()).collect();
    for (row, index) in rows.enumerate() {
        let at = place(index, &data.shape)?;
        for k in 0..piece {
            places[at * piece + k] = data.len() + row * piece + k;
        }
    }
    Tensor::chain(&[data, updates]).taken(data.shape.clone(), &places)
}

/// Returns the place in a tensor of this shape for each index along the node's axis.
fn element_places(call: &Call<'_>, shape: &[usize]) -> Result<Vec<usize>> {
    let at = axis(call.int("axis").unwrap_or(0), shape.len())?;
    let (indices, of) = (call.integers(1, "the indices")?, &call.input(1)?.shape);
    let fits = of.len() == shape.len() && (0..of.len()).all(|i| i == at || of[i] <= shape[i]);
    ensure!(fits, "its indices of {of:?} do not fit {shape:?}");
    let one = |(i, &index): (usize, &i64)| {
        let (mut left, mut place, mut stride) = (i, 0, 1);
        for k in (0..of.len()).rev() {
            let along = if k == at { axis(index, shape[k])? } else { left % of[k] };
            place += along * stride;
            left /= of[k];
            stride *= shape[k];
        }
        Ok(place)
    };
    indices.iter().enumerate().map(one).collect()
}

/// Gathers single elements at known indices along an axis.
pub(crate) fn gather_elements(call: &Call<'_>) -> Result<Tensor> {
    let input = call.input(0)?;
    input.taken(call.input(1)?.shape.clone(), &element_places(call, &input.shape)?)
}

/// Replaces single elements at known indices along an axis.
pub(crate) fn scatter_elements(call: &Call<'_>) -> Result<Tensor> {
    let (data, updates) = (call.input(0)?, call.input(2)?);
    refuse_reduction(call)?;
    ensure!(updates.shape == call.input(1)?.shape, "its updates do not fit its indices");
    let mut places: Vec<usize> = (0..data.len()).collect();
    for (k, place) in element_places(call, &data.shape)?.into_iter().enumerate() {
        places[place] = data.len() + k;
    }
    Tensor::chain(&[data, updates]).taken(data.shape.clone(), &places)
}
