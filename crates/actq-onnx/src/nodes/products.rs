//! Products with constant matrices.

use std::sync::Arc;

use actq::error::{Context as _, Result, bail, ensure};

use crate::nodes::arithmetic::two;
use crate::nodes::attention;
use crate::nodes::call::Call;
use crate::nodes::moves::{expanded, transposed};
use crate::nodes::places::broadcast;
use crate::values::elements::open_vector;
use crate::values::expr::{Exprs, Matrix};
use crate::values::tensor::{Data, Element, Tensor, count};

/// Returns the output, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Option<Tensor>> {
    match call.op() {
        "MatMul" => product(exprs, call.input(0)?, call.input(1)?, 1.0, budget).map(Some),
        "Gemm" => gemm(call, exprs, budget).map(Some),
        _ => Ok(None),
    }
}

/// Computes `alpha A B + beta C`.
fn gemm(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Tensor> {
    let turned = |i: usize, name: &str| {
        let x = call.input(i)?;
        ensure!(x.shape.len() == 2, "needs a matrix and reads the shape {:?}", x.shape);
        if call.int(name).unwrap_or(0) == 0 {
            return Ok(x.clone());
        }
        Ok(Tensor { name: x.name.clone(), ..transposed(x, &[1, 0])? })
    };
    let (a, b) = (turned(0, "transA")?, turned(1, "transB")?);
    let y = product(exprs, &a, &b, call.float("alpha").unwrap_or(1.0), budget)?;
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

/// Returns the matrix of a known tensor [cols, rows], times a factor.
fn matrix(w: &Tensor, factor: f64, what: &str) -> Result<Arc<Matrix>> {
    let &[cols, rows] = &w.shape[..] else { bail!("{what} has the shape {:?}; it must be a matrix", w.shape) };
    let values = w.reals().with_context(|| format!("{what} depends on the observation"))?;
    let data = (0..rows * cols).map(|i| factor * values[i % cols * rows + i / cols]).collect();
    Ok(Arc::new(Matrix { name: w.name.clone(), rows, cols, data }))
}

/// Computes `factor A B`, at least one of which is known.
pub(crate) fn product(exprs: &mut Exprs, a: &Tensor, b: &Tensor, factor: f64, budget: &mut usize) -> Result<Tensor> {
    ensure!(!a.shape.is_empty() && !b.shape.is_empty(), "multiplies {:?} with {:?}", a.shape, b.shape);
    match (a.is_known(), b.is_known()) {
        (_, true) => {}
        // A B is the transpose of B' A'.
        (true, false) => {
            let flat = |x: &Tensor| -> Result<Tensor> {
                let mut order: Vec<usize> = (0..x.shape.len()).collect();
                if let [.., last, end] = &mut order[..] {
                    std::mem::swap(last, end);
                }
                Ok(Tensor { name: x.name.clone(), ..transposed(x, &order)? })
            };
            let y = product(exprs, &flat(b)?, &flat(a)?, factor, budget)?;
            return if a.shape.len() > 1 && b.shape.len() > 1 { flat(&y) } else { Ok(y) };
        }
        (false, false) => return attention::product(exprs, a, b, factor, *budget),
    }
    // Leading axes of length 1 have no effect.
    let ones = b.shape.len().saturating_sub(2);
    if b.shape[..ones].iter().any(|&n| n != 1) {
        return products(exprs, a, b, factor, budget);
    }
    let vector = b.shape.len() == 1;
    let mut shape = b.shape[ones..].to_vec();
    shape.resize(2, 1);
    let w = matrix(&Tensor { name: b.name.clone(), ..b.reshaped(shape)? }, factor, "the constant")?;
    let n = a.shape[a.shape.len() - 1];
    ensure!(n == w.cols && n > 0, "multiplies {:?} with {:?}", a.shape, b.shape);
    let rows = a.len() / n;
    ensure!(
        rows.checked_mul(w.rows).is_some_and(|values| values <= *budget),
        "multiplies {:?} with {:?}, which gives more values than a policy of this size can have",
        a.shape,
        b.shape
    );
    // The work is bounded, too, as every row multiplies its known elements.
    ensure!(
        a.len().checked_mul(w.rows).is_some_and(|work| work <= budget.saturating_mul(64)),
        "multiplies {:?} with {:?}, which takes more work than a policy of this size can have",
        a.shape,
        b.shape
    );
    let mut all = Vec::new();
    for row in a.elements().chunks(n) {
        all.extend(row_product(exprs, row, &w, budget)?);
    }
    let mut out = a.shape[..a.shape.len() - 1].to_vec();
    if !vector {
        out.push(w.rows);
    }
    let missing = b.shape.len().saturating_sub(out.len().max(2));
    Ok(Tensor::of_elements([vec![1; missing], out].concat(), all))
}

/// Computes the product of several matrices, as in an ensemble, each with its own rows of `a`.
fn products(exprs: &mut Exprs, a: &Tensor, b: &Tensor, factor: f64, budget: &mut usize) -> Result<Tensor> {
    let (&[ref of_a @ .., m, n], &[ref of_b @ .., k, cols]) = (&a.shape[..], &b.shape[..]) else {
        bail!("multiplies {:?} with {:?}; several matrices need several rows each", a.shape, b.shape)
    };
    let of_both = broadcast(of_a, of_b)?;
    let of_each = |x: &Tensor, shape: [usize; 2]| {
        expanded(x, &[&of_both[..], &shape].concat(), *budget).map(|all| (all, shape[0] * shape[1]))
    };
    let ((rows, of_rows), (matrices, of_matrix)) = (of_each(a, [m, n])?, of_each(b, [k, cols])?);
    let mut all = Vec::new();
    for i in 0..count(&of_both)? {
        let part = |x: &Tensor, len: usize, shape: [usize; 2]| {
            x.taken(shape.to_vec(), &(i * len..(i + 1) * len).collect::<Vec<_>>())
        };
        let name = b.name.as_ref().map(|name| format!("{name}.{i}"));
        let matrix = Tensor { name, ..part(&matrices, of_matrix, [k, cols])? };
        all.extend(product(exprs, &part(&rows, of_rows, [m, n])?, &matrix, factor, budget)?.elements());
    }
    Ok(Tensor::of_elements([of_both, vec![m, cols]].concat(), all))
}

/// Multiplies a vector. Known elements go to the bias, and their columns are removed. The remaining matrix counts in
/// the budget.
pub(crate) fn row_product(
    exprs: &mut Exprs,
    x: &[Element],
    w: &Arc<Matrix>,
    budget: &mut usize,
) -> Result<Vec<Element>> {
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
        let (rows, cols) = (w.rows, open.len());
        let left = rows.checked_mul(cols).and_then(|n| budget.checked_sub(n)).with_context(|| {
            format!(
                "removes columns of constants or padding from its matrix, and the remaining {rows} x {cols} weights are more than a \
                 policy of this size can have; export the part after it"
            )
        })?;
        *budget = left;
        let data = w.data.chunks(w.cols).flat_map(|row| open.iter().map(|&i| row[i])).collect();
        Arc::new(Matrix { name: w.name.clone(), rows, cols, data })
    };
    let x: Vec<Element> = open.into_iter().map(|i| x[i]).collect();
    let x = open_vector(exprs, &x)?;
    let y = exprs.linear(x, w, bias);
    Ok(exprs.elements(y))
}
