//! Matrix products, norms, and sums over axes.

use std::sync::Arc;

use anyhow::{Context as _, Result, bail, ensure};

use super::call::Call;
use super::expr::{Expr, Exprs, Id, Matrix, Unary};
use super::known::{Reduced, reduced};
use super::places::{axis, transpose};
use super::pointwise::two;
use super::tensor::{Data, Element, Tensor, count};
use crate::import::numbers::positive;

/// The output, where the node is such an operation.
pub(super) fn run(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let epsilon = call.float("epsilon").unwrap_or(1e-5);
    match call.op() {
        "MatMul" => product(exprs, call.input(0)?, call.input(1)?, 1.0).map(Some),
        "Gemm" => gemm(call, exprs).map(Some),
        "LayerNormalization" => {
            let scale = call.reals(1, "the scale")?;
            let bias = if call.optional(2).is_some() { call.reals(2, "the bias")? } else { vec![0.0; scale.len()] };
            positive(epsilon, "epsilon")?;
            norm(call, exprs, scale.len(), bias.len(), &|x| Expr::LayerNorm(x, scale.clone(), bias.clone(), epsilon))
                .map(Some)
        }
        "RMSNormalization" | "SimplifiedLayerNormalization" => {
            let scale = call.reals(1, "the scale")?;
            positive(epsilon, "epsilon")?;
            norm(call, exprs, scale.len(), scale.len(), &|x| Expr::RmsNorm(x, scale.clone(), epsilon)).map(Some)
        }
        "BatchNormalization" => batch_norm(call, exprs, epsilon).map(Some),
        "ReduceSum" | "ReduceMean" | "ReduceL2" | "ReduceSumSquare" => reduce(call, exprs).map(Some),
        "LpNormalization" => {
            ensure!(call.int("p").unwrap_or(2) == 2, "only the norm with p = 2 is taken");
            let x = call.input(0)?;
            let at = axis(call.int("axis").unwrap_or(-1), x.shape.len())?;
            ensure!(at + 1 == x.shape.len(), "only the last axis can be normalized; export with Transpose around it");
            rows(exprs, x, x.shape[at], &mut |exprs, row| {
                let length = root_of_squares(exprs, row);
                let inverse = exprs.unary(Unary::Reciprocal, length);
                let inverse = exprs.vector(&vec![(inverse, 0); exprs.len_of(row)]);
                exprs.mul(row, inverse)
            })
            .map(Some)
        }
        _ => Ok(None),
    }
}

fn root_of_squares(exprs: &mut Exprs, x: Id) -> Id {
    let squares = exprs.mul(x, x);
    let sum = exprs.sum(squares);
    exprs.unary(Unary::Sqrt, sum)
}

/// The vector of elements none of which is known.
pub(super) fn open_vector(exprs: &mut Exprs, elements: &[Element]) -> Result<Id> {
    let one = |e: &Element| if let Element::Of(id, i) = e { Some((*id, *i)) } else { None };
    let values: Option<Vec<(Id, usize)>> = elements.iter().map(one).collect();
    Ok(exprs.vector(&values.context("mixes constants and values of the network in one vector")?))
}

/// Applies what works on a vector to every run of `n` elements.
fn rows(exprs: &mut Exprs, x: &Tensor, n: usize, f: &mut dyn FnMut(&mut Exprs, Id) -> Id) -> Result<Tensor> {
    ensure!(n > 0 && x.len() > 0, "works on no values");
    let mut all = Vec::with_capacity(x.len());
    for row in x.elements().chunks(n) {
        let row = open_vector(exprs, row)?;
        let result = f(exprs, row);
        all.extend(exprs.elements(result));
    }
    Ok(Tensor::of_elements(x.shape.clone(), all))
}

fn norm(call: &Call<'_>, exprs: &mut Exprs, scales: usize, biases: usize, expr: &dyn Fn(Id) -> Expr) -> Result<Tensor> {
    let x = call.input(0)?;
    let at = axis(call.int("axis").unwrap_or(-1), x.shape.len())?;
    let n = count(&x.shape[at..])?;
    ensure!(scales == n && biases == n, "norms {n} values with {scales} scales and {biases} biases");
    rows(exprs, x, n, &mut |exprs, row| exprs.put(expr(row), n))
}

/// What inference makes of a batch norm: a factor and an offset for each channel.
fn batch_norm(call: &Call<'_>, exprs: &mut Exprs, eps: f64) -> Result<Tensor> {
    let x = call.input(0)?;
    ensure!(
        x.shape.len() >= 2 && call.int("training_mode").unwrap_or(0) == 0,
        "only inference over [batch, channel, ..] is taken"
    );
    let [scale, bias, mean, variance] =
        [(1, "the scale"), (2, "the bias"), (3, "the mean"), (4, "the variance")].map(|(i, what)| call.reals(i, what));
    let (scale, bias, mean, variance) = (scale?, bias?, mean?, variance?);
    let n = x.shape[1];
    ensure!(
        [&scale, &bias, &mean, &variance].iter().all(|v| v.len() == n),
        "its constants are not one for each of {n} channels"
    );
    ensure!(variance.iter().all(|v| v + eps > 0.0), "a variance with epsilon {eps} is not above 0");
    let a: Vec<f64> = scale.iter().zip(&variance).map(|(s, v)| s / (v + eps).sqrt()).collect();
    let b = bias.iter().zip(&mean).zip(&a).map(|((b, m), a)| b - m * a).collect();
    let mut shape = vec![n];
    shape.resize(x.shape.len() - 1, 1);
    let [a, b] = [a, b].map(|v| Tensor::new(shape.clone(), Data::Real(v)));
    let scaled = two("Mul", exprs, x, &a, x.len())?;
    two("Add", exprs, &scaled, &b, x.len())
}

fn reduce(call: &Call<'_>, exprs: &mut Exprs) -> Result<Tensor> {
    let x = call.input(0)?;
    let Reduced { axes, shape } = reduced(call)?;
    let order: Vec<usize> = (0..x.shape.len()).filter(|i| !axes.contains(i)).chain(axes.iter().copied()).collect();
    let (turned, places) = transpose(&x.shape, &order)?;
    let outputs = count(&shape)?;
    ensure!(outputs > 0 && x.len() > 0, "goes over no values");
    let each = x.len() / outputs;
    let mut all = Vec::with_capacity(outputs);
    for row in x.taken(turned, &places)?.elements().chunks(each) {
        let row = open_vector(exprs, row)?;
        let one = match call.op() {
            "ReduceL2" => root_of_squares(exprs, row),
            "ReduceSumSquare" => {
                let squares = exprs.mul(row, row);
                exprs.sum(squares)
            }
            "ReduceMean" => {
                let sum = exprs.sum(row);
                exprs.scaled(sum, 1.0 / each as f64, 0.0)
            }
            _ => exprs.sum(row),
        };
        all.extend(exprs.elements(one));
    }
    Ok(Tensor::of_elements(shape, all))
}

/// `alpha A B + beta C`
fn gemm(call: &Call<'_>, exprs: &mut Exprs) -> Result<Tensor> {
    let turned = |i: usize, name: &str| {
        let x = call.input(i)?;
        ensure!(x.shape.len() == 2, "takes matrices, not {:?}", x.shape);
        if call.int(name).unwrap_or(0) == 0 {
            return Ok(x.clone());
        }
        let (shape, places) = transpose(&x.shape, &[1, 0])?;
        Ok(Tensor { name: x.name.clone(), ..x.taken(shape, &places)? })
    };
    let (a, b) = (turned(0, "transA")?, turned(1, "transB")?);
    let y = product(exprs, &a, &b, call.float("alpha").unwrap_or(1.0))?;
    let Some(c) = call.optional(2) else { return Ok(y) };
    let beta = Tensor::new(vec![], Data::Real(vec![call.float("beta").unwrap_or(1.0)]));
    let c = match c.reals() {
        Some(c) if beta.data == Data::Real(vec![1.0]) => Tensor::new(call.input(2)?.shape.clone(), Data::Real(c)),
        Some(v) => {
            let factor = call.float("beta").unwrap_or(1.0);
            Tensor::new(c.shape.clone(), Data::Real(v.iter().map(|v| factor * v).collect()))
        }
        None => two("Mul", exprs, c, &beta, c.len())?,
    };
    two("Add", exprs, &y, &c, y.len())
}

/// The matrix of a tensor [cols, rows] that is known, times a factor.
fn matrix(w: &Tensor, factor: f64, what: &str) -> Result<Arc<Matrix>> {
    let &[cols, rows] = &w.shape[..] else { bail!("{what} is {:?}; a matrix is taken", w.shape) };
    let values = w.reals().with_context(|| format!("{what} is not known"))?;
    let data = (0..rows * cols).map(|i| factor * values[i % cols * rows + i / cols]).collect();
    Ok(Arc::new(Matrix { name: w.name.clone(), rows, cols, data }))
}

/// `factor A B`, one of which is known.
fn product(exprs: &mut Exprs, a: &Tensor, b: &Tensor, factor: f64) -> Result<Tensor> {
    ensure!(!a.shape.is_empty() && !b.shape.is_empty(), "multiplies {:?} with {:?}", a.shape, b.shape);
    match (a.is_known(), b.is_known()) {
        (false, true) => {}
        // A B is B' A', turned.
        (true, false) => {
            let flat = |x: &Tensor| -> Result<Tensor> {
                let mut order: Vec<usize> = (0..x.shape.len()).collect();
                if let [.., last, end] = &mut order[..] {
                    std::mem::swap(last, end);
                }
                let (shape, places) = transpose(&x.shape, &order)?;
                Ok(Tensor { name: x.name.clone(), ..x.taken(shape, &places)? })
            };
            let y = product(exprs, &flat(b)?, &flat(a)?, factor)?;
            return if a.shape.len() > 1 && b.shape.len() > 1 { flat(&y) } else { Ok(y) };
        }
        (true, true) => bail!("multiplies constants of {:?} and {:?}", a.shape, b.shape),
        (false, false) => bail!(
            "multiplies two values of the network, as attention does; only products with constant matrices are taken"
        ),
    }
    // Leading axes of length 1 say nothing.
    let ones = b.shape.len().saturating_sub(2);
    ensure!(b.shape[..ones].iter().all(|&n| n == 1), "multiplies with several matrices at once, {:?}", b.shape);
    let vector = b.shape.len() == 1;
    let mut shape = b.shape[ones..].to_vec();
    shape.resize(2, 1);
    let w = matrix(&Tensor { name: b.name.clone(), ..b.reshaped(shape)? }, factor, "the constant")?;
    let n = a.shape[a.shape.len() - 1];
    ensure!(n == w.cols && n > 0, "multiplies {:?} with {:?}", a.shape, b.shape);
    let mut all = Vec::new();
    for row in a.elements().chunks(n) {
        all.extend(row_product(exprs, row, &w)?);
    }
    let mut out = a.shape[..a.shape.len() - 1].to_vec();
    if !vector {
        out.push(w.rows);
    }
    let missing = b.shape.len().saturating_sub(out.len().max(2));
    Ok(Tensor::of_elements([vec![1; missing], out].concat(), all))
}

/// The product of a vector; what is known of it goes into the bias, without its columns.
fn row_product(exprs: &mut Exprs, x: &[Element], w: &Arc<Matrix>) -> Result<Vec<Element>> {
    let open: Vec<usize> = (0..x.len()).filter(|&i| matches!(x[i], Element::Of(..))).collect();
    let known = |i: usize| if let Element::Known(v) = x[i] { v } else { 0.0 };
    let bias: Vec<f64> =
        w.data.chunks(w.cols).map(|row| row.iter().enumerate().map(|(i, w)| w * known(i)).sum()).collect();
    if open.is_empty() {
        return Ok(bias.into_iter().map(Element::Known).collect());
    }
    let w = if open.len() == x.len() {
        Arc::clone(w)
    } else {
        let data = w.data.chunks(w.cols).flat_map(|row| open.iter().map(|&i| row[i])).collect();
        Arc::new(Matrix { name: w.name.clone(), rows: w.rows, cols: open.len(), data })
    };
    let x: Vec<Element> = open.into_iter().map(|i| x[i]).collect();
    let x = open_vector(exprs, &x)?;
    let y = exprs.linear(x, w, bias);
    Ok(exprs.elements(y))
}
