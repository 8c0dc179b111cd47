//! Constant folding: shape computations, and constants that exporters compute in the file.

use std::cmp::Ordering;

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::call::Call;
use crate::nodes::moves::{expanded, transposed};
use crate::nodes::places::{axis, broadcast};
use crate::values::tensor::{Data, Tensor, count};

/// Name of Mod with the attribute fmod: the result has the sign of the first operand, else of the second. Real numbers
/// require it.
const FMOD: &str = "Mod, fmod";

/// Returns the output, if all inputs are known.
pub(crate) fn run(call: &Call<'_>, most: usize) -> Result<Option<Tensor>> {
    let given: Vec<&Tensor> = call.inputs.iter().copied().flatten().collect();
    if given.is_empty() || !given.iter().all(|tensor| tensor.is_known()) {
        return Ok(None);
    }
    if let [one] = given[..]
        && let Some(f) = function(call.op())
    {
        return unary(one, call.op(), f).map(Some);
    }
    let op = if call.op() == "Mod" && call.int("fmod").unwrap_or(0) != 0 { FMOD } else { call.op() };
    if let [x, y] = given[..]
        && (real(op).is_some() || whole(op).is_some() || compared(op).is_some())
    {
        let shape = broadcast(&x.shape, &y.shape)?;
        let (x, y) = (expanded(x, &shape, most)?, expanded(y, &shape, most)?);
        return binary(op, &x, &y, shape).map(Some);
    }
    match call.op() {
        "ReduceProd" | "ReduceSum" | "ReduceMean" | "ReduceMax" | "ReduceMin" => reduce(call, given[0]).map(Some),
        "DequantizeLinear" => dequantized(call).map(Some),
        "NonZero" => nonzero(given[0]).map(Some),
        "Trilu" => triangle(call).map(Some),
        _ => Ok(None),
    }
}

/// Returns the places that are not zero: a row for each axis, a column for each place. Masks of observations give it.
fn nonzero(x: &Tensor) -> Result<Tensor> {
    let places: Vec<usize> =
        x.reals().context("is not known")?.iter().enumerate().filter(|(_, v)| **v != 0.0).map(|(i, _)| i).collect();
    let mut rows = Vec::with_capacity(x.shape.len() * places.len());
    for (axis, &len) in x.shape.iter().enumerate() {
        let stride: usize = x.shape[axis + 1..].iter().product();
        rows.extend(places.iter().map(|place| (place / stride % len) as i64));
    }
    Ok(Tensor::new(vec![x.shape.len(), places.len()], Data::Int(rows)))
}

/// Keeps the upper or the lower triangle of matrices; the others become 0.
fn triangle(call: &Call<'_>) -> Result<Tensor> {
    let x = call.input(0)?;
    let &[.., rows, cols] = &x.shape[..] else { bail!("needs a matrix and reads the shape {:?}", x.shape) };
    let k =
        if call.optional(1).is_some() { call.integers(1, "the diagonal")?.first().copied().unwrap_or(0) } else { 0 };
    let is_upper = call.int("upper").unwrap_or(1) != 0;
    let stays = |i: usize| {
        let over = (i % cols) as i64 - (i / cols % rows) as i64;
        if is_upper { over >= k } else { over <= k }
    };
    let data = match &x.data {
        Data::Int(v) => Data::Int(v.iter().enumerate().map(|(i, v)| if stays(i) { *v } else { 0 }).collect()),
        _ => {
            let v = x.reals().context("is not known")?;
            Data::Real(v.iter().enumerate().map(|(i, v)| if stays(i) { *v } else { 0.0 }).collect())
        }
    };
    Ok(Tensor::new(x.shape.clone(), data))
}

/// Dequantizes weights with one scale and zero point for all, for each index of an axis, or for each block of an axis.
fn dequantized(call: &Call<'_>) -> Result<Tensor> {
    let (x, scale) = (call.input(0)?, call.input(1)?);
    let block = usize::try_from(call.int("block_size").unwrap_or(0)).ok().context("has a negative block_size")?;
    let n = scale.len();
    // Elements of one scale are those of equal `place`.
    let (len, inner, each) = if n == 1 && block == 0 {
        (1, 1, 1)
    } else {
        let at = axis(call.int("axis").unwrap_or(1), x.shape.len())?;
        let mut shape = if block == 0 { vec![x.shape[at]] } else { x.shape.clone() };
        if block > 0 {
            shape[at] = x.shape[at].div_ceil(block);
        }
        ensure!(
            scale.shape == shape,
            "has scales of the shape {:?} for weights of {:?} along axis {at} with block_size {block}; the shape {shape:?} fits",
            scale.shape,
            x.shape
        );
        (x.shape[at], count(&x.shape[at + 1..])?, block)
    };
    let blocks = len.div_ceil(each.max(1));
    let place = |i: usize| match each {
        _ if n == 1 => 0,
        0 => i / inner % len,
        each => (i / (inner * len) * blocks + i / inner % len / each) * inner + i % inner,
    };
    let (scales, values) = (call.reals(1, "the scale")?, call.reals(0, "the quantized tensor")?);
    let zeros = if call.optional(2).is_some() { call.reals(2, "the zero point")? } else { vec![0.0; n] };
    ensure!(zeros.len() == n, "has {} zero points for {n} scales", zeros.len());
    let values = values.iter().enumerate().map(|(i, v)| (v - zeros[place(i)]) * scales[place(i)]);
    Ok(Tensor::new(x.shape.clone(), Data::Real(values.collect())))
}

/// Returns a function of one known number that has no kernel, or that applies to integers.
fn function(op: &str) -> Option<fn(f64) -> f64> {
    Some(match op {
        "Neg" => |x| -x,
        "Abs" => f64::abs,
        "Floor" => f64::floor,
        "Ceil" => f64::ceil,
        "Round" => f64::round_ties_even,
        "Sign" => |x| if x == 0.0 { 0.0 } else { x.signum() },
        "Not" => |x| f64::from(u8::from(x == 0.0)),
        _ => return None,
    })
}

fn unary(x: &Tensor, op: &str, f: fn(f64) -> f64) -> Result<Tensor> {
    let data = match (&x.data, op) {
        (Data::Int(v), "Neg") => Data::Int(v.iter().map(|v| v.wrapping_neg()).collect()),
        (Data::Int(v), "Abs") => Data::Int(v.iter().map(|v| v.wrapping_abs()).collect()),
        (Data::Int(v), "Not") => Data::Int(v.iter().map(|&v| i64::from(v == 0)).collect()),
        (Data::Int(v), "Floor" | "Ceil" | "Round") => Data::Int(v.clone()),
        _ => Data::Real(x.reals().context("is not known")?.into_iter().map(f).collect()),
    };
    Ok(Tensor::new(x.shape.clone(), data))
}

/// Returns an operation on two known numbers.
pub(crate) fn real(op: &str) -> Option<fn(f64, f64) -> f64> {
    Some(match op {
        "Add" => |x, y| x + y,
        "Sub" => |x, y| x - y,
        "Mul" => |x, y| x * y,
        "Div" => |x, y| x / y,
        "Pow" => libm::pow,
        "Max" => f64::max,
        "Min" => f64::min,
        FMOD => |x, y| x % y,
        "PRelu" => |x, slope| if x < 0.0 { slope * x } else { x },
        _ => return None,
    })
}

/// Returns an operation on two known integers with an integer result. Division rounds towards zero.
fn whole(op: &str) -> Option<fn(i64, i64) -> Option<i64>> {
    Some(match op {
        "Add" => i64::checked_add,
        "Sub" => i64::checked_sub,
        "Mul" => i64::checked_mul,
        "Div" => i64::checked_div,
        "Mod" => |x, y| {
            let rest = x.checked_rem(y)?;
            Some(if rest != 0 && (rest < 0) != (y < 0) { rest + y } else { rest })
        },
        FMOD => i64::checked_rem,
        "Pow" => |x, y| x.checked_pow(u32::try_from(y).ok()?),
        "Max" => |x, y| Some(x.max(y)),
        "Min" => |x, y| Some(x.min(y)),
        "And" => |x, y| Some(i64::from(x != 0 && y != 0)),
        "Or" => |x, y| Some(i64::from(x != 0 || y != 0)),
        _ => return None,
    })
}

/// Returns a comparison.
fn compared(op: &str) -> Option<fn(Ordering) -> bool> {
    Some(match op {
        "Equal" => Ordering::is_eq,
        "Less" => Ordering::is_lt,
        "LessOrEqual" => Ordering::is_le,
        "Greater" => Ordering::is_gt,
        "GreaterOrEqual" => Ordering::is_ge,
        _ => return None,
    })
}

fn binary(op: &str, x: &Tensor, y: &Tensor, shape: Vec<usize>) -> Result<Tensor> {
    let truths = |values: Vec<bool>| Data::Int(values.into_iter().map(i64::from).collect());
    if let (Some(x), Some(y)) = (x.integers(), y.integers()) {
        if let Some(holds) = compared(op) {
            return Ok(Tensor::new(shape, truths(x.iter().zip(y).map(|(x, y)| holds(x.cmp(y))).collect())));
        }
        if let Some(f) = whole(op) {
            let values = x.iter().zip(y).map(|(&x, &y)| f(x, y)).collect::<Option<Vec<i64>>>();
            return Ok(Tensor::new(shape, Data::Int(values.context("its integers overflow, or it divides by 0")?)));
        }
    }
    let (x, y) = (x.reals().context("is not known")?, y.reals().context("is not known")?);
    let pairs = x.into_iter().zip(y);
    if let Some(holds) = compared(op) {
        // All comparisons with NaN are false.
        return Ok(Tensor::new(shape, truths(pairs.map(|(x, y)| x.partial_cmp(&y).is_some_and(holds)).collect())));
    }
    let f = real(op).context("needs integers or booleans, and reads real numbers")?;
    Ok(Tensor::new(shape, Data::Real(pairs.map(|(x, y)| f(x, y)).collect())))
}

/// The axes that a Reduce node reduces, and the shape of its result.
pub(crate) struct Reduced {
    pub(crate) axes: Vec<usize>,
    pub(crate) shape: Vec<usize>,
}

impl Reduced {
    /// Returns a tensor in runs, each of which is reduced to one value, and the length of a run.
    pub(crate) fn runs(&self, x: &Tensor) -> Result<(Tensor, usize)> {
        let outputs = count(&self.shape)?;
        ensure!(outputs > 0 && x.len() > 0, "goes over no values");
        let others = (0..x.shape.len()).filter(|i| !self.axes.contains(i));
        let order: Vec<usize> = others.chain(self.axes.iter().copied()).collect();
        Ok((transposed(x, &order)?, x.len() / outputs))
    }
}

/// Returns the axes of a Reduce node and the shape of its result.
pub(crate) fn reduced(call: &Call<'_>) -> Result<Reduced> {
    let shape = &call.input(0)?.shape;
    let axes = match call.ints_or_input("axes", 1)? {
        Some(axes) if !axes.is_empty() => axes.into_iter().map(|a| axis(a, shape.len())).collect::<Result<Vec<_>>>()?,
        _ if call.int("noop_with_empty_axes").unwrap_or(0) != 0 => vec![],
        _ => (0..shape.len()).collect(),
    };
    let keep = call.int("keepdims").unwrap_or(1) != 0;
    let kept = |(i, &n): (usize, &usize)| if axes.contains(&i) { keep.then_some(1) } else { Some(n) };
    Ok(Reduced { shape: shape.iter().enumerate().filter_map(kept).collect(), axes })
}

fn reduce(call: &Call<'_>, x: &Tensor) -> Result<Tensor> {
    let reduced = reduced(call)?;
    let (x, each) = reduced.runs(x)?;
    let fold = |run: &[f64]| match call.op() {
        "ReduceProd" => run.iter().product::<f64>(),
        "ReduceSum" => run.iter().sum(),
        "ReduceMean" => run.iter().sum::<f64>() / each as f64,
        "ReduceMax" => run.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        _ => run.iter().copied().fold(f64::INFINITY, f64::min),
    };
    let values: Vec<f64> = x.reals().context("is not known")?.chunks(each).map(fold).collect();
    // f64 holds lengths of axes exactly.
    let data =
        if x.integers().is_some() { Data::Int(values.iter().map(|&v| v as i64).collect()) } else { Data::Real(values) };
    Ok(Tensor::new(reduced.shape, data))
}
