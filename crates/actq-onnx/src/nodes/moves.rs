//! Operators that only move elements, and operators on shapes. They treat known and open elements alike.

use actq::error::{Context as _, Result, bail, ensure};
use half::{bf16, f16};

use crate::file::kinds;
use crate::nodes::call::Call;
use crate::nodes::gather;
use crate::nodes::places::{self, Places, along, axis, broadcast};
use crate::values::tensor::{Data, Tensor, count, room};

/// Returns the outputs, with at most `most` elements, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, most: usize) -> Result<Option<Vec<Tensor>>> {
    let one = |tensor: Tensor| Ok(Some(vec![tensor]));
    match call.op() {
        "Identity" => one(call.input(0)?.clone()),
        "Dropout" => {
            let trains = call.optional(2).is_some_and(|mode| mode.integers().is_none_or(|mode| mode != [0]));
            ensure!(!trains, "is in training mode, and drops values at random; export for inference");
            one(call.input(0)?.clone())
        }
        "Cast" | "CastLike" => one(cast(call)?),
        "Constant" => one(constant(call)?),
        "Shape" => {
            let shape: Vec<i64> = call.input(0)?.shape.iter().map(|&n| n as i64).collect();
            let (start, end) = (call.int("start").unwrap_or(0), call.int("end").unwrap_or(i64::MAX));
            let kept = places::slice(shape.len(), start, end, 1)?;
            one(Tensor::ints(kept.into_iter().map(|i| shape[i]).collect()))
        }
        "Size" => one(Tensor::new(vec![], Data::Int(vec![call.input(0)?.len() as i64]))),
        "Range" => one(range(call, most)?),
        "Reshape" => one(reshape(call)?),
        "Flatten" => {
            let input = call.input(0)?;
            let rank = input.shape.len();
            let at = match call.int("axis").unwrap_or(1) {
                at if at == rank as i64 => rank,
                at => axis(at, rank.max(1))?,
            };
            let (rows, cols) = input.shape.split_at(at.min(rank));
            one(input.reshaped(vec![count(rows)?, count(cols)?])?)
        }
        "Squeeze" => {
            let input = call.input(0)?;
            let rank = input.shape.len();
            let axes = match call.ints_or_input("axes", 1)? {
                Some(axes) => axes.into_iter().map(|a| axis(a, rank)).collect::<Result<Vec<_>>>()?,
                None => (0..rank).filter(|&i| input.shape[i] == 1).collect(),
            };
            let kept = (0..rank).filter(|i| !axes.contains(i)).map(|i| input.shape[i]).collect();
            one(input.reshaped(kept).context("squeezes an axis of more than one value")?)
        }
        "Unsqueeze" => {
            let input = call.input(0)?;
            let axes = call.ints_or_input("axes", 1)?.context("has no axes")?;
            let rank = input.shape.len() + axes.len();
            let axes = axes.into_iter().map(|a| axis(a, rank)).collect::<Result<Vec<_>>>()?;
            let mut rest = input.shape.iter();
            let shape = (0..rank).map(|i| if axes.contains(&i) { Some(1) } else { rest.next().copied() });
            one(input.reshaped(shape.collect::<Option<_>>().context("names an axis twice")?)?)
        }
        "Transpose" => {
            let input = call.input(0)?;
            let rank = input.shape.len();
            let order = match call.ints("perm") {
                Some(perm) => perm.into_iter().map(|a| axis(a, rank)).collect::<Result<Vec<_>>>()?,
                None => (0..rank).rev().collect(),
            };
            one(transposed(input, &order)?)
        }
        "Slice" => one(slice(call)?),
        "Split" => split(call).map(Some),
        "Gather" => one(gather::gather(call, most)?),
        "GatherElements" => one(gather::gather_elements(call)?),
        "GatherND" => one(gather::gather_nd(call, most)?),
        "Concat" => one(concat(call)?),
        "Expand" => {
            let input = call.input(0)?;
            let shape = lengths(&call.integers(1, "the shape")?)?;
            one(expanded(input, &broadcast(&input.shape, &shape)?, most)?)
        }
        "Tile" => {
            let input = call.input(0)?;
            let times = lengths(&call.integers(1, "the repeats")?)?;
            let out: Option<Vec<usize>> = input.shape.iter().zip(&times).map(|(&n, &t)| n.checked_mul(t)).collect();
            room(&out.context("the repeats exceed the range of a length")?, most)?;
            one(taken(input, places::tile(&input.shape, &times)?)?)
        }
        "Where" => where_known(call, most),
        "ScatterElements" => one(gather::scatter_elements(call)?),
        "ScatterND" => one(gather::scatter_nd(call)?),
        "Pad" => one(pad(call, most)?),
        _ => Ok(None),
    }
}

fn taken(input: &Tensor, (shape, places): Places) -> Result<Tensor> {
    input.taken(shape, &places)
}

/// Returns a tensor with its axes in this order.
pub(crate) fn transposed(input: &Tensor, order: &[usize]) -> Result<Tensor> {
    taken(input, places::transpose(&input.shape, order)?)
}

/// Broadcasts a tensor to a shape.
pub(crate) fn expanded(input: &Tensor, shape: &[usize], most: usize) -> Result<Tensor> {
    if input.shape == shape {
        return Ok(input.clone());
    }
    room(shape, most)?;
    input.taken(shape.to_vec(), &places::expand(&input.shape, shape)?)
}

fn lengths(shape: &[i64]) -> Result<Vec<usize>> {
    let axes = shape.iter().map(|&n| usize::try_from(n).ok()).collect::<Option<_>>();
    axes.with_context(|| format!("{shape:?} has a negative length"))
}

/// Rounds known numbers to another type.
fn rounded(input: &Tensor, to: fn(f64) -> f64) -> Vec<f64> {
    input.reals().unwrap_or_default().into_iter().map(to).collect()
}

/// Wraps an integer to ONNX's type `kind`, which keeps the low bits.
fn wrapped(v: i64, kind: i64) -> i64 {
    match kind {
        2 => i64::from(v as u8),
        3 => i64::from(v as i8),
        4 => i64::from(v as u16),
        5 => i64::from(v as i16),
        6 => i64::from(v as i32),
        12 => i64::from(v as u32),
        _ => v,
    }
}

/// Converts a cast. Values of the network are float32, so that casts between float32 and float64 keep them.
fn cast(call: &Call<'_>) -> Result<Tensor> {
    let input = call.input(0)?;
    let to = match call.op() {
        "CastLike" => {
            if matches!(call.input(1)?.data, Data::Int(_)) {
                7
            } else {
                1
            }
        }
        _ => call.int("to").unwrap_or(0),
    };
    let data = match (to, &input.data) {
        (1 | 11, Data::Int(v)) => Data::Real(v.iter().map(|&v| v as f64).collect()),
        (1 | 11, data) => data.clone(),
        (10, Data::Real(_) | Data::Int(_)) => Data::Real(rounded(input, |v| f16::from_f64(v).to_f64())),
        (16, Data::Real(_) | Data::Int(_)) => Data::Real(rounded(input, |v| bf16::from_f64(v).to_f64())),
        (9, Data::Int(v)) => Data::Int(v.iter().map(|&v| i64::from(v != 0)).collect()),
        (9, Data::Real(v)) => Data::Int(v.iter().map(|&v| i64::from(v != 0.0)).collect()),
        (2..=7 | 12 | 13, Data::Int(v)) => Data::Int(v.iter().map(|&v| wrapped(v, to)).collect()),
        (2..=7 | 12 | 13, Data::Real(v)) => {
            let whole = |v: &f64| {
                let one = *v as i64;
                ensure!(
                    one as f64 == v.trunc() && wrapped(one, to) == one,
                    "casts {v} to {}, which cannot hold it",
                    kinds::name(to as i32)
                );
                Ok(one)
            };
            Data::Int(v.iter().map(whole).collect::<Result<_>>()?)
        }
        _ => {
            bail!("rounds a value of the network to {}; export the whole policy in float32", kinds::name(to as i32))
        }
    };
    Ok(Tensor { data, ..input.clone() })
}

fn constant(call: &Call<'_>) -> Result<Tensor> {
    if let Some(v) = call.int("value_int") {
        return Ok(Tensor::new(vec![], Data::Int(vec![v])));
    }
    if let Some(v) = call.float("value_float") {
        return Ok(Tensor::new(vec![], Data::Real(vec![v])));
    }
    if let Some(v) = call.ints("value_ints") {
        return Ok(Tensor::ints(v));
    }
    let floats = call
        .node
        .attributes
        .get("value_floats")
        .context("its value has an unsupported type; export it as float32 or int64")?;
    let values: Vec<f64> = floats.floats.iter().map(|&v| v.into()).collect();
    Ok(Tensor::new(vec![values.len()], Data::Real(values)))
}

/// Makes a tensor of a known shape from one number.
pub(crate) fn constant_of_shape(call: &Call<'_>, fill: &Data, most: usize) -> Result<Tensor> {
    let shape = lengths(&call.integers(0, "the shape")?)?;
    let n = room(&shape, most)?;
    Ok(Tensor::new(
        shape,
        match fill {
            Data::Int(v) => Data::Int(vec![v.first().copied().unwrap_or(0); n]),
            Data::Real(v) => Data::Real(vec![v.first().copied().unwrap_or(0.0); n]),
            Data::Open(_) => bail!("its value is not known"),
        },
    ))
}

fn range(call: &Call<'_>, most: usize) -> Result<Tensor> {
    let whole = |i: usize| call.input(i).is_ok_and(|t| t.integers().is_some());
    let bound = |i: usize| call.reals(i, "a bound")?.first().copied().context("has a bound without a value");
    let (start, limit, step) = (bound(0)?, bound(1)?, bound(2)?);
    let n = ((limit - start) / step).ceil().max(0.0);
    ensure!(n.is_finite() && n <= most as f64, "has too many values from {start} to {limit} in steps of {step}");
    let values = (0..n as usize).map(|i| start + i as f64 * step);
    Ok(Tensor::new(
        vec![n as usize],
        match whole(0) {
            true => Data::Int(values.map(|v| v as i64).collect()),
            false => Data::Real(values.collect()),
        },
    ))
}

fn reshape(call: &Call<'_>) -> Result<Tensor> {
    let input = call.input(0)?;
    let wanted = call.ints_or_input("shape", 1)?.context("has no shape")?;
    let keep = call.int("allowzero").unwrap_or(0) == 0;
    let axis = |(i, n): (usize, i64)| match n {
        0 if keep => input.shape.get(i).copied().map(Some).context("keeps the length of an axis that the input lacks"),
        -1 => Ok(None),
        n => usize::try_from(n).map(Some).with_context(|| format!("{n} is not a length of an axis")),
    };
    let axes = wanted.into_iter().enumerate().map(axis).collect::<Result<Vec<_>>>()?;
    ensure!(axes.iter().filter(|a| a.is_none()).count() <= 1, "leaves two lengths open");
    let rest = count(&axes.iter().map(|a| a.unwrap_or(1)).collect::<Vec<_>>())?;
    let open = input.len().checked_div(rest).unwrap_or(0);
    input.reshaped(axes.into_iter().map(|a| a.unwrap_or(open)).collect())
}

fn slice(call: &Call<'_>) -> Result<Tensor> {
    let input = call.input(0)?;
    let starts = call.ints_or_input("starts", 1)?.context("has no starts")?;
    let ends = call.ints_or_input("ends", 2)?.context("has no ends")?;
    let axes = call.ints_or_input("axes", 3)?.unwrap_or_else(|| (0..starts.len() as i64).collect());
    let steps = if call.optional(4).is_some() { call.integers(4, "the steps")? } else { vec![1; starts.len()] };
    ensure!(
        ends.len() == starts.len() && axes.len() == starts.len() && steps.len() == starts.len(),
        "has starts, ends, axes and steps of different lengths"
    );
    let mut kept = input.clone();
    for (((start, end), at), step) in starts.into_iter().zip(ends).zip(axes).zip(steps) {
        let at = axis(at, kept.shape.len())?;
        let chosen = places::slice(kept.shape[at], start, end, step)?;
        if chosen.len() != kept.shape[at] || step < 0 {
            kept = taken(&kept, along(&kept.shape, at, chosen)?)?;
        }
    }
    Ok(kept)
}

fn split(call: &Call<'_>) -> Result<Vec<Tensor>> {
    let input = call.input(0)?;
    let at = axis(call.int("axis").unwrap_or(0), input.shape.len())?;
    let n = input.shape[at];
    let parts = match call.ints_or_input("split", 1)? {
        Some(parts) => lengths(&parts)?,
        None => {
            let outputs =
                call.int("num_outputs").and_then(|n| usize::try_from(n).ok()).unwrap_or(call.node.outputs.len());
            ensure!((1..=n.max(1)).contains(&outputs), "{n} values cannot be split into {outputs} parts");
            let each = n.div_ceil(outputs);
            (0..outputs).map(|i| each.min(n.saturating_sub(i * each))).collect()
        }
    };
    let sum = parts.iter().try_fold(0usize, |n, &part| n.checked_add(part));
    ensure!(sum == Some(n), "its parts {parts:?} do not add up to the {n} values of the axis");
    let mut from = 0;
    let mut part = |len: usize| {
        from += len;
        taken(input, along(&input.shape, at, (from - len..from).collect())?)
    };
    parts.into_iter().map(&mut part).collect()
}

fn concat(call: &Call<'_>) -> Result<Tensor> {
    let parts = call.inputs.iter().copied().flatten().collect::<Vec<_>>();
    let first = parts.first().context("has no input to join")?;
    joined(&parts, axis(call.int("axis").unwrap_or(0), first.shape.len())?)
}

/// Joins tensors along an axis.
pub(crate) fn joined(parts: &[&Tensor], at: usize) -> Result<Tensor> {
    let first = parts.first().context("has no input to join")?;
    for part in parts {
        let fits = part.shape.len() == first.shape.len();
        let fits = fits && (0..first.shape.len()).all(|i| i == at || part.shape[i] == first.shape[i]);
        ensure!(fits, "joins {:?} to {:?} along axis {at}", part.shape, first.shape);
    }
    // Concatenates the elements of all parts, then picks each row's piece of every part.
    let mut shape = first.shape.clone();
    shape[at] = parts.iter().map(|part| part.shape[at]).sum();
    let rows = count(&shape[..at])?;
    let mut found = Vec::with_capacity(count(&shape)?);
    for row in 0..rows {
        let mut from = 0;
        for part in parts {
            let piece = part.len() / rows;
            found.extend(from + row * piece..from + (row + 1) * piece);
            from += part.len();
        }
    }
    Tensor::chain(parts).taken(shape, &found)
}

/// Converts Pad, which adds or removes values at both ends of axes.
fn pad(call: &Call<'_>, most: usize) -> Result<Tensor> {
    let input = call.input(0)?;
    let pads = call.ints_or_input("pads", 1)?.context("has no pads")?;
    let fill = match call.optional(2) {
        Some(_) => call.reals(2, "the value of the padding")?.first().copied().unwrap_or(0.0),
        None => call.float("value").unwrap_or(0.0),
    };
    let rank = input.shape.len();
    let axes = if call.optional(3).is_some() { call.integers(3, "the axes")? } else { (0..rank as i64).collect() };
    ensure!(pads.len() == 2 * axes.len(), "has {} pads for {} axes", pads.len(), axes.len());
    let mode = call.text("mode").unwrap_or_else(|| "constant".to_owned());
    ensure!(mode == "constant", "has the mode {mode:?}; only constant padding is supported");
    let mut all = input.clone();
    for (&at, (&before, &after)) in axes.iter().zip(pads.iter().zip(&pads[axes.len()..])) {
        let at = axis(at, rank)?;
        // Negative pads remove values.
        let end = if after < 0 { after } else { i64::MAX };
        let kept = places::slice(all.shape[at], before.min(0).saturating_neg(), end, 1)?;
        let kept = taken(&all, along(&all.shape, at, kept)?)?;
        let of_length = |n: usize| [&kept.shape[..at], &[n], &kept.shape[at + 1..]].concat();
        let [before, after] = [before, after].map(|n| usize::try_from(n.max(0)).unwrap_or(usize::MAX));
        room(&of_length(kept.shape[at].saturating_add(before).saturating_add(after)), most)?;
        let block = |n: usize| -> Result<Tensor> {
            let shape = of_length(n);
            let n = count(&shape)?;
            Ok(Tensor::new(shape, Data::Real(vec![fill; n])))
        };
        all = joined(&[&block(before)?, &kept, &block(after)?], at)?;
    }
    Ok(all)
}

/// Converts a choice that is known for every element.
fn where_known(call: &Call<'_>, most: usize) -> Result<Option<Vec<Tensor>>> {
    let (options, x, y) = (call.input(0)?, call.input(1)?, call.input(2)?);
    if options.integers().is_none() {
        return Ok(None);
    }
    let shape = broadcast(&broadcast(&options.shape, &x.shape)?, &y.shape)?;
    let options = expanded(options, &shape, most)?;
    let (x, y) = (expanded(x, &shape, most)?, expanded(y, &shape, most)?);
    let n = x.len();
    let places: Vec<usize> = options
        .integers()
        .unwrap_or_default()
        .iter()
        .enumerate()
        .map(|(i, &c)| if c != 0 { i } else { n + i })
        .collect();
    Ok(Some(vec![Tensor::chain(&[&x, &y]).taken(shape, &places)?]))
}
