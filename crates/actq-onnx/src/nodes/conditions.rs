//! Comparisons of values with numbers, and choices by them that form an activation.

use actq::error::{Context as _, Result};

use crate::nodes::call::Call;
use crate::nodes::moves::expanded;
use crate::nodes::places::broadcast;
use crate::values::elements::{apply, value};
use crate::values::expr::{Expr, Exprs, Guard, Id, Unary};
use crate::values::tensor::{Data, Element, Tensor};

/// Converts a comparison of a value with one number to [`Unary::Above`].
pub(crate) fn above(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let greater = call.op().starts_with("Greater");
    let (x, y) = (call.input(0)?, call.input(1)?);
    let (compared, limit, sign) = match (x.reals(), y.reals()) {
        (None, Some(y)) => (x, y, if greater { 1.0 } else { -1.0 }),
        (Some(x), None) => (y, x, if greater { -1.0 } else { 1.0 }),
        _ => return Ok(None),
    };
    // A limit that broadcasts the value along an axis would change its shape.
    let (Some(limit), true) =
        (crate::values::compare::uniform(&limit), broadcast(&x.shape, &y.shape)? == compared.shape)
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

/// Tests for NaN or infinity. Elements of values count as finite, as an image gives no action if one is not.
pub(crate) fn not_finite(call: &Call<'_>, exprs: &mut Exprs) -> Result<Tensor> {
    let found = |v: f64| match call.op() {
        "IsNaN" => v.is_nan(),
        _ => v.is_infinite() && call.int(if v > 0.0 { "detect_positive" } else { "detect_negative" }) != Some(0),
    };
    let one = |element: &Element| if let Element::Known(v) = element { found(*v).into() } else { 0 };
    let x = call.input(0)?;
    if !x.is_known() {
        exprs.guards.insert((exprs.node, if call.op() == "IsNaN" { Guard::Nan } else { Guard::Infinity }));
    }
    Ok(Tensor::new(x.shape.clone(), Data::Int(x.elements().iter().map(one).collect())))
}

/// Converts the comparison of a value with itself, a test for NaN.
pub(crate) fn itself(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let (x, y) = (call.input(0)?, call.input(1)?);
    let same = x.shape == y.shape && x.elements() == y.elements();
    if same && !x.is_known() {
        exprs.guards.insert((exprs.node, Guard::Nan));
    }
    Ok(same.then(|| Tensor::new(x.shape.clone(), Data::Int(vec![1; x.len()]))))
}

/// Converts `And` and `Or` if one side of every element is known.
pub(crate) fn both(call: &Call<'_>, most: usize) -> Result<Option<Tensor>> {
    let (x, y) = (call.input(0)?, call.input(1)?);
    let shape = broadcast(&x.shape, &y.shape)?;
    // The side that decides the result: false for And, true for Or.
    let decides = f64::from(u8::from(call.op() == "Or"));
    let one = |(x, y): (Element, Element)| match (x, y) {
        (Element::Known(v), other) | (other, Element::Known(v)) => {
            let truth = f64::from(u8::from(v != 0.0));
            Some(if truth == decides { Element::Known(truth) } else { other })
        }
        _ => None,
    };
    let (x, y) = (expanded(x, &shape, most)?.elements(), expanded(y, &shape, most)?.elements());
    let all = x.into_iter().zip(y).map(one).collect::<Option<Vec<_>>>();
    Ok(all.map(|all| truths(shape, all)))
}

/// Returns a tensor of booleans, if its elements are.
pub(crate) fn as_truth(input: &Tensor, exprs: &Exprs) -> Option<Tensor> {
    let is_truth = |e: &Element| match *e {
        Element::Known(v) => v == 0.0 || v == 1.0,
        Element::Of(id, _) => matches!(exprs.get(id), Expr::Unary(Unary::Above(_), _)),
    };
    let elements = input.elements();
    elements.iter().all(is_truth).then(|| truths(input.shape.clone(), elements))
}

/// Makes a tensor of booleans, of integers if all are known.
fn truths(shape: Vec<usize>, elements: Vec<Element>) -> Tensor {
    let tensor = Tensor::of_elements(shape, elements);
    match tensor.data {
        Data::Real(values) => Tensor::new(tensor.shape, Data::Int(values.into_iter().map(|v| v as i64).collect())),
        _ => tensor,
    }
}

/// Converts `not (x > limit)` to `-x > -limit`. They differ at the limit only, where both choices of an activation
/// agree.
pub(crate) fn not(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let input = call.input(0)?;
    let Some(values) = input.elements().iter().map(value).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let condition = exprs.vector(&values);
    Ok(negated(exprs, condition).map(|below| Tensor::of_elements(input.shape.clone(), exprs.elements(below))))
}

/// Returns `-x > -limit` for `x > limit`.
fn negated(exprs: &mut Exprs, condition: Id) -> Option<Id> {
    let &Expr::Unary(Unary::Above(limit), x) = exprs.get(condition) else { return None };
    let negative = exprs.scaled(x, -1.0, 0.0);
    Some(exprs.unary(Unary::Above(-limit), negative))
}

/// Converts a choice by a value of the network that forms an activation.
pub(crate) fn options(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Tensor> {
    let refused =
        || format!("chooses by a value of the network and does not form an activation; {}", crate::nodes::call::HELP);
    let (condition, x, y) = (call.input(0)?, call.input(1)?, call.input(2)?);
    let shape = broadcast(&broadcast(&condition.shape, &x.shape)?, &y.shape)?;
    let [condition, x, y] = [condition, x, y].map(|tensor| expanded(tensor, &shape, most).map(|t| t.elements()));
    let (condition, x, y) = (condition?, x?, y?);
    let values = |elements: &[Element]| elements.iter().map(value).collect::<Option<Vec<_>>>();
    let uniform = |elements: &[Element]| match elements.first()? {
        Element::Known(v) => elements.iter().all(|e| e == &elements[0]).then_some(*v),
        Element::Of(..) => None,
    };
    let condition = exprs.vector(&values(&condition).with_context(refused)?);
    let chosen = match (values(&x), values(&y)) {
        (Some(x), Some(y)) => {
            let (x, y) = (exprs.vector(&x), exprs.vector(&y));
            // A comparison of the negative value swaps the choices.
            exprs.select(condition, x, y).or_else(|| {
                let other = negated(exprs, condition)?;
                exprs.select(other, y, x)
            })
        }
        (Some(open), None) => uniform(&y).and_then(|other| {
            let open = exprs.vector(&open);
            exprs.select_constant(condition, open, other, true)
        }),
        (None, Some(open)) => uniform(&x).and_then(|other| {
            let open = exprs.vector(&open);
            exprs.select_constant(condition, open, other, false)
        }),
        _ => None,
    };
    Ok(Tensor::of_elements(shape, exprs.elements(chosen.with_context(refused)?)))
}
