//! Operations on two values, or on a value and constants.

use actq::error::{Context as _, Result, bail, ensure};
use actq_kernels::math::Function;

use crate::nodes::known;
use crate::nodes::moves::expanded;
use crate::nodes::places::broadcast;
use crate::patterns::rows::by_row;
use crate::values::elements::{in_order, open_vector, value};
use crate::values::expr::{Exprs, Id, Unary};
use crate::values::tensor::{Element, Tensor};

/// The open, that is not known, ones of two elements.
#[derive(Clone, Copy, PartialEq)]
enum Open {
    Neither,
    First,
    Second,
    Both,
}

/// Applies an operation to two values, broadcast to one shape.
pub(crate) fn two(op: &str, exprs: &mut Exprs, x: &Tensor, y: &Tensor, most: usize) -> Result<Tensor> {
    let shape = broadcast(&x.shape, &y.shape)?;
    let (mut x, mut y) = (expanded(x, &shape, most)?.elements(), expanded(y, &shape, most)?.elements());
    if matches!(op, "Add" | "Sub" | "Mul" | "Div") {
        open_rows(exprs, &mut x, &y)?;
    }
    if matches!(op, "Add" | "Mul") {
        open_rows(exprs, &mut y, &x)?;
    }
    let open = |i: usize| match (value(&x[i]), value(&y[i])) {
        (None, None) => Open::Neither,
        (Some(_), None) => Open::First,
        (None, Some(_)) => Open::Second,
        (Some(_), Some(_)) => Open::Both,
    };
    let known = |element: &Element| if let Element::Known(v) = element { *v } else { 0.0 };
    let mut all = x.clone();
    for kind in [Open::Neither, Open::First, Open::Second, Open::Both] {
        let at: Vec<usize> = (0..x.len()).filter(|&i| open(i) == kind).collect();
        if at.is_empty() {
            continue;
        }
        for at in by_row(exprs, at, [&x, &y]) {
            let at = in_order(at, &|i| {
                let (x, y) = (value(&x[i]), value(&y[i]));
                [x.or(y).unwrap_or_default(), y.or(x).unwrap_or_default()]
            });
            let [values_x, values_y] = [&x, &y].map(|v| at.iter().filter_map(|&i| value(&v[i])).collect::<Vec<_>>());
            let [known_x, known_y] = [&x, &y].map(|v| at.iter().map(|&i| known(&v[i])).collect::<Vec<f64>>());
            let result = match kind {
                Open::Neither => {
                    let f = known::real(op)
                        .with_context(|| format!("{op} of constants that are mixed with values is not supported"))?;
                    known_x.into_iter().zip(known_y).map(|(x, y)| Element::Known(f(x, y))).collect()
                }
                Open::First => {
                    let x = exprs.vector(&values_x);
                    with_known(op, exprs, x, &known_y)?
                }
                Open::Second => {
                    let y = exprs.vector(&values_y);
                    known_with(op, exprs, &known_x, y)?
                }
                Open::Both => {
                    let (x, y) = (exprs.vector(&values_x), exprs.vector(&values_y));
                    let result = both(op, exprs, x, y)?;
                    exprs.known_elements(result)
                }
            };
            at.into_iter().zip(result).for_each(|(i, element)| all[i] = element);
        }
    }
    Ok(Tensor::of_elements(shape, all))
}

/// Makes vectors of rows that hold constants, if `numbers` has a number computed from sums for each row. Such a row may
/// be divided by its length or lose its mean, as in a norm.
fn open_rows(exprs: &mut Exprs, elements: &mut [Element], numbers: &[Element]) -> Result<()> {
    let is_mixed = |row: &[Element]| row.iter().any(|e| value(e).is_some()) && row.iter().any(|e| value(e).is_none());
    if !is_mixed(elements) {
        return Ok(());
    }
    for at in by_row(exprs, (0..elements.len()).collect(), [numbers; 2]) {
        let [row, numbers] = [&*elements, numbers].map(|all| at.iter().map(|&i| all[i]).collect::<Vec<Element>>());
        if is_mixed(&row) && exprs.is_number_of_sums(&numbers) {
            let whole = open_vector(exprs, &row)?;
            at.into_iter().zip(exprs.elements(whole)).for_each(|(i, element)| elements[i] = element);
        }
    }
    Ok(())
}

/// Computes `a x + b`; elements with a factor of 0 are known.
fn affine(exprs: &mut Exprs, x: Id, a: Vec<f64>, b: Vec<f64>) -> Result<Vec<Element>> {
    ensure!(a.iter().chain(&b).all(|v| v.is_finite()), "has a constant that is not finite, or divides by 0");
    let known: Vec<Option<f64>> = a.iter().zip(&b).map(|(&a, &b)| (a == 0.0).then_some(b)).collect();
    let kept = |values: Vec<f64>, none: f64| {
        values.into_iter().zip(&known).map(|(v, k)| if k.is_some() { none } else { v }).collect()
    };
    let value = exprs.affine(x, kept(a, 1.0), kept(b, 0.0));
    let elements = exprs.elements(value).into_iter().zip(known);
    Ok(elements.map(|(element, known)| known.map_or(element, Element::Known)).collect())
}

fn with_known(op: &str, exprs: &mut Exprs, x: Id, y: &[f64]) -> Result<Vec<Element>> {
    let (ones, zeros) = (vec![1.0; y.len()], vec![0.0; y.len()]);
    let same = crate::values::compare::uniform(y);
    match op {
        // The additive mask of an attention.
        "Add" if y.contains(&f64::NEG_INFINITY) => {
            let masked = |y: &f64| *y == f64::NEG_INFINITY;
            let finite = y.iter().map(|y| if masked(y) { 0.0 } else { *y }).collect();
            let sum = affine(exprs, x, ones, finite)?.into_iter().zip(y);
            Ok(sum.map(|(sum, y)| if masked(y) { Element::Known(*y) } else { sum }).collect())
        }
        "Add" => affine(exprs, x, ones, y.to_vec()),
        "Sub" => affine(exprs, x, ones, y.iter().map(|y| -y).collect()),
        "Mul" => affine(exprs, x, y.to_vec(), zeros),
        "Div" => affine(exprs, x, y.iter().map(|y| 1.0 / y).collect(), zeros),
        "PRelu" => {
            let value = exprs.leaky(x, y.to_vec());
            Ok(exprs.elements(value))
        }
        "Pow" | "Max" | "Min" => {
            let value = match (op, same) {
                ("Pow", Some(p)) => power(exprs, x, p)?,
                ("Max", Some(low)) => exprs.clip(x, low, f64::INFINITY),
                ("Min", Some(high)) => exprs.clip(x, f64::NEG_INFINITY, high),
                _ => {
                    ensure!(op != "Pow", "has several exponents; use one exponent for all elements");
                    return Ok(exprs.limited_each(x, y, if op == "Max" { 1.0 } else { -1.0 }));
                }
            };
            Ok(exprs.elements(value))
        }
        _ => bail!("{op} of a value and a constant is not supported"),
    }
}

fn known_with(op: &str, exprs: &mut Exprs, x: &[f64], y: Id) -> Result<Vec<Element>> {
    match op {
        "Add" | "Mul" | "Max" | "Min" => with_known(op, exprs, y, x),
        "Sub" => affine(exprs, y, vec![-1.0; x.len()], x.to_vec()),
        "Div" => {
            let reciprocal = exprs.unary(Unary::Reciprocal, y);
            affine(exprs, reciprocal, x.to_vec(), vec![0.0; x.len()])
        }
        // b^y is e^(y ln b).
        "Pow" if x.iter().all(|b| *b > 0.0) => {
            let exponent = exprs.affine(y, x.iter().map(|b| libm::log(*b)).collect(), vec![0.0; x.len()]);
            let power = exprs.function(Function::Exp, exponent);
            Ok(exprs.elements(power))
        }
        _ => bail!("{op} of a constant and a value is not supported"),
    }
}

fn both(op: &str, exprs: &mut Exprs, x: Id, y: Id) -> Result<Id> {
    Ok(match op {
        "Add" => exprs.add(x, y),
        "Mul" => exprs.mul(x, y),
        "Sub" => {
            let negative = exprs.scaled(y, -1.0, 0.0);
            exprs.add(x, negative)
        }
        "Div" => {
            let reciprocal = exprs.unary(Unary::Reciprocal, y);
            exprs.mul(x, reciprocal)
        }
        "Max" => match exprs.ratio(y, x) {
            Some(slope) if (0.0..1.0).contains(&slope) => {
                let slopes = vec![slope; exprs.len_of(x)];
                exprs.leaky(x, slopes)
            }
            _ => exprs.max(x, y),
        },
        "Min" => exprs.min(x, y),
        _ => bail!("{op} of two values of the network is not supported"),
    })
}

/// Computes `x` to the power p.
fn power(exprs: &mut Exprs, x: Id, p: f64) -> Result<Id> {
    Ok(match p {
        1.0 => x,
        2.0 => exprs.mul(x, x),
        3.0 => {
            let square = exprs.mul(x, x);
            exprs.mul(square, x)
        }
        4.0 => {
            let square = exprs.mul(x, x);
            exprs.mul(square, square)
        }
        0.5 => exprs.unary(Unary::Sqrt, x),
        -0.5 => {
            let root = exprs.unary(Unary::Sqrt, x);
            exprs.unary(Unary::Reciprocal, root)
        }
        -1.0 => exprs.unary(Unary::Reciprocal, x),
        _ => bail!("has the exponent {p}; use 1, 2, 3, 4, -1, 0.5 or -0.5"),
    })
}
