//! Places of elements when a tensor is sliced, joined, transposed or repeated: for each element of the result, its
//! place in the operand. Known and open elements move alike.

use actq::error::{Context as _, Result, ensure};

use crate::values::tensor::count;

/// A shape, and for each of its elements the place in the operand.
pub(crate) type Places = (Vec<usize>, Vec<usize>);

/// Returns the index of an axis; a negative axis counts from the end.
pub(crate) fn axis(axis: i64, rank: usize) -> Result<usize> {
    let from_start = if axis < 0 { axis.checked_add(rank as i64) } else { Some(axis) };
    let found = from_start.and_then(|a| usize::try_from(a).ok()).filter(|&a| a < rank);
    found.with_context(|| format!("axis or index {axis} is out of range for {rank}"))
}

/// Returns the distance of neighbours along every axis.
fn strides(shape: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; shape.len()];
    for i in (1..shape.len()).rev() {
        strides[i - 1] = strides[i] * shape[i];
    }
    strides
}

/// Returns all places of `shape` with the chosen indices along each axis.
fn grid(shape: &[usize], along: &[Vec<usize>]) -> Result<Places> {
    let out: Vec<usize> = along.iter().map(Vec::len).collect();
    let mut places = Vec::with_capacity(count(&out)?);
    places.push(0);
    for (along, stride) in along.iter().zip(strides(shape)) {
        places = places.iter().flat_map(|&at| along.iter().map(move |&i| at + i * stride)).collect();
    }
    Ok((out, places))
}

/// Returns the places with the chosen indices of one axis and all indices of the others.
pub(crate) fn along(shape: &[usize], axis: usize, chosen: Vec<usize>) -> Result<Places> {
    ensure!(chosen.iter().all(|&i| i < shape[axis]), "an index is out of range for an axis of {} values", shape[axis]);
    let mut axes: Vec<Vec<usize>> = shape.iter().map(|&n| (0..n).collect()).collect();
    axes[axis] = chosen;
    grid(shape, &axes)
}

/// Returns the indices that ONNX's Slice keeps of an axis of `len` values.
pub(crate) fn slice(len: usize, start: i64, end: i64, step: i64) -> Result<Vec<usize>> {
    ensure!(step != 0, "has a step of 0");
    if len == 0 {
        return Ok(Vec::new());
    }
    let n = len as i64;
    let from_end = |i: i64| if i < 0 { i.saturating_add(n) } else { i };
    let (low, high) = if step > 0 { (0, n) } else { (-1, n - 1) };
    let (mut at, end) = (from_end(start).clamp(low.max(0), high), from_end(end).clamp(low, high));
    let mut kept = Vec::new();
    while if step > 0 { at < end } else { at > end } {
        kept.push(at as usize);
        at = at.saturating_add(step);
    }
    Ok(kept)
}

/// Returns the places with the axes in another order.
pub(crate) fn transpose(shape: &[usize], order: &[usize]) -> Result<Places> {
    let mut seen = vec![false; shape.len()];
    order.iter().for_each(|&axis| seen[axis] = true);
    ensure!(
        order.len() == shape.len() && seen.iter().all(|s| *s),
        "{order:?} is not a permutation of {} axes",
        shape.len()
    );
    let from = strides(shape);
    let out: Vec<usize> = order.iter().map(|&axis| shape[axis]).collect();
    let mut places = vec![0];
    for (&axis, &n) in order.iter().zip(&out) {
        places =
            places.iter().flat_map(|&at| (0..n).map(move |i| (at, i))).map(|(at, i)| at + i * from[axis]).collect();
    }
    Ok((out, places))
}

/// Returns the shape that both broadcast to, by numpy's rules.
pub(crate) fn broadcast(a: &[usize], b: &[usize]) -> Result<Vec<usize>> {
    let rank = a.len().max(b.len());
    let at = |shape: &[usize], i: usize| if i + shape.len() < rank { 1 } else { shape[i + shape.len() - rank] };
    let one = |i: usize| match (at(a, i), at(b, i)) {
        (x, y) if x == y => Ok(x),
        (1, n) | (n, 1) => Ok(n),
        _ => actq::bail!("shapes {a:?} and {b:?} do not broadcast"),
    };
    (0..rank).map(one).collect()
}

/// Returns the places of a tensor that is broadcast to the shape `out` from [`broadcast`].
pub(crate) fn expand(shape: &[usize], out: &[usize]) -> Result<Vec<usize>> {
    ensure!(broadcast(shape, out)? == out, "{shape:?} cannot be expanded to {out:?}");
    let mut from = vec![0; out.len() - shape.len()];
    from.extend(strides(shape).into_iter().zip(shape).map(|(stride, &n)| if n == 1 { 0 } else { stride }));
    let mut places = vec![0];
    for (&n, stride) in out.iter().zip(from) {
        places = places.iter().flat_map(|&at| (0..n).map(move |i| at + i * stride)).collect();
    }
    Ok(places)
}

/// Returns the places of a tensor that is repeated along every axis.
pub(crate) fn tile(shape: &[usize], times: &[usize]) -> Result<Places> {
    ensure!(times.len() == shape.len(), "has {} repeats for {} axes", times.len(), shape.len());
    let axes: Vec<Vec<usize>> = shape.iter().zip(times).map(|(&n, &t)| (0..t).flat_map(|_| 0..n).collect()).collect();
    grid(shape, &axes)
}
