//! Comparisons of values with numbers, and choices by them where they make up an activation.

use anyhow::{Context as _, Result};

use super::call::Call;
use super::elements::{apply, value};
use super::expr::{Expr, Exprs, Unary};
use super::moves::expanded;
use super::places::broadcast;
use super::tensor::{Element, Tensor};

/// A comparison of a value with one number, as whether something is above one.
pub(super) fn above(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let greater = call.op().starts_with("Greater");
    let (x, y) = (call.input(0)?, call.input(1)?);
    let (compared, limit, sign) = match (x.reals(), y.reals()) {
        (None, Some(y)) => (x, y, if greater { 1.0 } else { -1.0 }),
        (Some(x), None) => (y, x, if greater { -1.0 } else { 1.0 }),
        _ => return Ok(None),
    };
    // A limit that repeats the value along an axis would change its shape.
    let (Some(limit), true) = (super::compare::uniform(&limit), broadcast(&x.shape, &y.shape)? == compared.shape)
    else {
        return Ok(None);
    };
    let elements = compared.elements();
    let Some(values) = elements.iter().map(value).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let conditions = apply(exprs, &values, &|exprs, x| {
        let x = exprs.scaled(x, sign, 0.0);
        exprs.unary(Unary::Above(sign * limit), x)
    });
    Ok(Some(Tensor::of_elements(compared.shape.clone(), conditions)))
}

/// Not above a limit: the negative value is above the negative limit, or at it, where the choices that are taken agree.
pub(super) fn not(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let input = call.input(0)?;
    let Some(values) = input.elements().iter().map(value).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let condition = exprs.vector(&values);
    let &Expr::Unary(Unary::Above(limit), x) = exprs.get(condition) else { return Ok(None) };
    let negative = exprs.scaled(x, -1.0, 0.0);
    let below = exprs.unary(Unary::Above(-limit), negative);
    Ok(Some(Tensor::of_elements(input.shape.clone(), exprs.elements(below))))
}

/// A choice by a value of the network, where it makes up an activation.
pub(super) fn choice(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Tensor> {
    let refused =
        || anyhow::anyhow!("chooses by a value of the network in a way that no activation does; {}", super::call::HELP);
    let (condition, x, y) = (call.input(0)?, call.input(1)?, call.input(2)?);
    let shape = broadcast(&broadcast(&condition.shape, &x.shape)?, &y.shape)?;
    let [condition, x, y] = [condition, x, y].map(|tensor| expanded(tensor, &shape, most).map(|t| t.elements()));
    let (condition, x, y) = (condition?, x?, y?);
    let values = |elements: &[Element]| elements.iter().map(value).collect::<Option<Vec<_>>>();
    let zeros = |elements: &[Element]| elements.iter().all(|e| *e == Element::Known(0.0));
    let condition = exprs.vector(&values(&condition).with_context(refused)?);
    let chosen = match (values(&x), values(&y)) {
        (Some(x), Some(y)) => {
            let (x, y) = (exprs.vector(&x), exprs.vector(&y));
            // Where it compares the negative, the choices are the other way round.
            exprs.select(condition, x, y).or_else(|| {
                let &Expr::Unary(Unary::Above(limit), of) = exprs.get(condition) else { return None };
                let negative = exprs.scaled(of, -1.0, 0.0);
                let other = exprs.unary(Unary::Above(-limit), negative);
                exprs.select(other, y, x)
            })
        }
        (Some(open), None) if zeros(&y) => {
            let open = exprs.vector(&open);
            exprs.select_zero(condition, open, true)
        }
        (None, Some(open)) if zeros(&x) => {
            let open = exprs.vector(&open);
            exprs.select_zero(condition, open, false)
        }
        _ => None,
    };
    Ok(Tensor::of_elements(shape, exprs.elements(chosen.with_context(refused)?)))
}
