//! Operations on the elements of values: functions, sums and products, limits.

use actq_kernels::math::Function;
use anyhow::{Context as _, Result, bail, ensure};

use super::call::Call;
use super::expr::{Exprs, Id, Unary};
use super::known;
use super::moves::expanded;
use super::places::broadcast;
use super::tensor::{Element, Tensor};

/// What works on all elements of a vector.
type OnVector = Box<dyn Fn(&mut Exprs, Id) -> Id>;

/// The output, where the node is such an operation.
pub(super) fn run(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Option<Tensor>> {
    match call.op() {
        "Add" | "Sub" | "Mul" | "Div" | "Pow" | "PRelu" => {
            let (x, y) = (call.input(0)?, call.input(1)?);
            two(call.op(), exprs, x, y, most).map(Some)
        }
        "Sum" | "Max" | "Min" | "Mean" => {
            let op = if matches!(call.op(), "Sum" | "Mean") { "Add" } else { call.op() };
            let given: Vec<&Tensor> = call.inputs.iter().copied().flatten().collect();
            let (first, rest) = given.split_first().context("has no input")?;
            let mut all = Tensor::clone(first);
            for next in rest {
                all = two(op, exprs, &all, next, most)?;
            }
            if call.op() == "Mean" {
                all = each(exprs, &all, &|exprs, x| exprs.scaled(x, 1.0 / given.len() as f64, 0.0), &|v| {
                    v / given.len() as f64
                });
            }
            Ok(Some(all))
        }
        "Greater" | "GreaterOrEqual" | "Less" | "LessOrEqual" => above(call, exprs),
        "Not" => not(call, exprs),
        "Where" => choice(call, exprs, most).map(Some),
        _ => one(call, exprs),
    }
}

/// A comparison of a value with one number, as whether something is above one.
fn above(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let greater = call.op().starts_with("Greater");
    let (x, y) = (call.input(0)?, call.input(1)?);
    let (value, limit, sign) = match (x.reals(), y.reals()) {
        (None, Some(y)) => (x, y, if greater { 1.0 } else { -1.0 }),
        (Some(x), None) => (y, x, if greater { -1.0 } else { 1.0 }),
        _ => return Ok(None),
    };
    let (Some(limit), true) = (super::compare::uniform(&limit), limit.len() == 1 || limit.len() == value.len()) else {
        return Ok(None);
    };
    let elements = value.elements();
    let Some(values) = elements.iter().map(self::value).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let compared = apply(exprs, &values, &|exprs, x| {
        let x = exprs.scaled(x, sign, 0.0);
        exprs.unary(Unary::Above(sign * limit), x)
    });
    Ok(Some(Tensor::of_elements(value.shape.clone(), compared)))
}

/// Not above a limit: the negative value is above the negative limit, or at it, where the choices that are taken agree.
fn not(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let input = call.input(0)?;
    let Some(values) = input.elements().iter().map(value).collect::<Option<Vec<_>>>() else { return Ok(None) };
    let condition = exprs.vector(&values);
    let &super::expr::Expr::Unary(Unary::Above(limit), x) = exprs.get(condition) else { return Ok(None) };
    let negative = exprs.scaled(x, -1.0, 0.0);
    let below = exprs.unary(Unary::Above(-limit), negative);
    Ok(Some(Tensor::of_elements(input.shape.clone(), exprs.elements(below))))
}

/// A choice by a value of the network, where it makes up an activation.
fn choice(call: &Call<'_>, exprs: &mut Exprs, most: usize) -> Result<Tensor> {
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
                let &super::expr::Expr::Unary(Unary::Above(limit), of) = exprs.get(condition) else { return None };
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

/// Applies what works on a vector to all elements that are not known, and `known` to the others.
fn each(exprs: &mut Exprs, x: &Tensor, open: &dyn Fn(&mut Exprs, Id) -> Id, known: &dyn Fn(f64) -> f64) -> Tensor {
    let elements = x.elements();
    let values: Vec<(Id, usize)> = elements.iter().filter_map(value).collect();
    let done = if values.is_empty() { Vec::new() } else { apply(exprs, &values, open) };
    let mut done = done.into_iter();
    let all = elements.into_iter().map(|element| match element {
        Element::Known(v) => Element::Known(known(v)),
        element => done.next().unwrap_or(element),
    });
    Tensor::of_elements(x.shape.clone(), all.collect())
}

fn apply(exprs: &mut Exprs, values: &[(Id, usize)], f: &dyn Fn(&mut Exprs, Id) -> Id) -> Vec<Element> {
    let x = exprs.vector(values);
    let y = f(exprs, x);
    exprs.elements(y)
}

fn value(element: &Element) -> Option<(Id, usize)> {
    if let Element::Of(id, i) = element { Some((*id, *i)) } else { None }
}

/// A function of one value.
fn one(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let number = |name: &str, default: f64| call.float(name).unwrap_or(default);
    let function = |function: Function| move |exprs: &mut Exprs, x: Id| exprs.function(function, x);
    let raw = |unary: Unary| move |exprs: &mut Exprs, x: Id| exprs.unary(unary, x);
    let leaky = |slope: f64| {
        move |exprs: &mut Exprs, x: Id| {
            let slopes = vec![slope; exprs.len_of(x)];
            exprs.leaky(x, slopes)
        }
    };
    let tanh_form = call.text("approximate").is_some_and(|form| form == "tanh");
    let open: OnVector = match call.op() {
        "Relu" => Box::new(function(Function::Relu)),
        "Tanh" => Box::new(function(Function::Tanh)),
        "Sigmoid" => Box::new(function(Function::Sigmoid)),
        "Softplus" => Box::new(function(Function::Softplus)),
        "Mish" => Box::new(function(Function::Mish)),
        "Gelu" if tanh_form => Box::new(function(Function::GeluTanh)),
        "Gelu" => Box::new(function(Function::Gelu)),
        "FastGelu" if call.optional(1).is_none() => Box::new(function(Function::GeluTanh)),
        "Swish" | "QuickGelu" => gate(number("alpha", if call.op() == "Swish" { 1.0 } else { 1.702 })),
        "Exp" => Box::new(function(Function::Exp)),
        "Sin" => Box::new(function(Function::Sin)),
        "Cos" => Box::new(function(Function::Cos)),
        "Log" => Box::new(raw(Unary::Log)),
        "Sqrt" => Box::new(raw(Unary::Sqrt)),
        "Erf" => Box::new(raw(Unary::Erf)),
        "Abs" => Box::new(raw(Unary::Abs)),
        "Reciprocal" => Box::new(raw(Unary::Reciprocal)),
        "Neg" => Box::new(|exprs: &mut Exprs, x: Id| exprs.scaled(x, -1.0, 0.0)),
        "Elu" => elu(number("alpha", 1.0), 1.0),
        "Celu" => {
            let alpha = number("alpha", 1.0);
            ensure!(alpha != 0.0, "has alpha 0");
            Box::new(move |exprs: &mut Exprs, x: Id| {
                let scaled = exprs.scaled(x, 1.0 / alpha, 0.0);
                let elu = exprs.function(Function::Elu, scaled);
                exprs.scaled(elu, alpha, 0.0)
            })
        }
        "Selu" => elu(number("alpha", 1.673_263_192_176_818_8), number("gamma", 1.050_701_022_148_132_3)),
        "LeakyRelu" => Box::new(leaky(number("alpha", 0.01))),
        "HardSigmoid" => {
            let (slope, middle) = (number("alpha", 0.2), number("beta", 0.5));
            Box::new(move |exprs: &mut Exprs, x: Id| hard_sigmoid(exprs, x, slope, middle))
        }
        "HardSwish" => Box::new(|exprs: &mut Exprs, x: Id| {
            let gate = hard_sigmoid(exprs, x, 1.0 / 6.0, 0.5);
            exprs.mul(x, gate)
        }),
        "Clip" => {
            let (low, high) = limits(call)?;
            ensure!(low <= high, "limits to {low} .. {high}, which is no range");
            if low == f64::NEG_INFINITY && high == f64::INFINITY {
                return call.input(0).cloned().map(Some);
            }
            let x = call.input(0)?;
            return Ok(Some(each(exprs, x, &|exprs, x| exprs.clip(x, low, high), &|v| v.clamp(low, high))));
        }
        _ => return Ok(None),
    };
    let x = call.input(0)?;
    // Constants among the values go through the same function.
    let known = known::function(call.op());
    let all_open = x.elements().iter().all(|e| value(e).is_some());
    ensure!(known.is_some() || all_open, "works on constants and values of the network at once");
    Ok(Some(each(exprs, x, &*open, &|v| known.map_or(v, |f| f(v)))))
}

/// `x sigmoid(k x)`
fn gate(k: f64) -> OnVector {
    Box::new(move |exprs, x| {
        let scaled = exprs.scaled(x, k, 0.0);
        let silu = exprs.function(Function::Silu, scaled);
        exprs.scaled(silu, 1.0 / k, 0.0)
    })
}

/// `gamma x` where positive, else `gamma alpha (exp(x) - 1)`: of the two, `alpha elu(x) + (1 - alpha) relu(x)`.
fn elu(alpha: f64, gamma: f64) -> OnVector {
    Box::new(move |exprs, x| {
        let elu = exprs.function(Function::Elu, x);
        let sum = if alpha == 1.0 {
            elu
        } else {
            let relu = exprs.function(Function::Relu, x);
            let (elu, relu) = (exprs.scaled(elu, alpha, 0.0), exprs.scaled(relu, 1.0 - alpha, 0.0));
            exprs.add(elu, relu)
        };
        exprs.scaled(sum, gamma, 0.0)
    })
}

fn hard_sigmoid(exprs: &mut Exprs, x: Id, slope: f64, middle: f64) -> Id {
    let line = exprs.scaled(x, slope, middle);
    exprs.clip(line, 0.0, 1.0)
}

/// The limits of a Clip: attributes before operator set 11, inputs since.
fn limits(call: &Call<'_>) -> Result<(f64, f64)> {
    let limit = |i: usize, name: &str, none: f64| match (call.float(name), call.optional(i)) {
        (Some(limit), _) => Ok(limit),
        (None, None) => Ok(none),
        (None, Some(_)) => {
            let values = call.reals(i, "a limit")?;
            values.first().copied().context("a limit has no value")
        }
    };
    // Exporters write f32's largest number where there is no limit.
    let open = |limit: f64| if limit.abs() >= f64::from(f32::MAX) { limit * f64::INFINITY } else { limit };
    Ok((open(limit(1, "min", f64::NEG_INFINITY)?), open(limit(2, "max", f64::INFINITY)?)))
}

/// Which of two elements are known.
#[derive(Clone, Copy, PartialEq)]
enum Open {
    Neither,
    First,
    Second,
    Both,
}

/// An operation on two values, repeated to one shape.
pub(super) fn two(op: &str, exprs: &mut Exprs, x: &Tensor, y: &Tensor, most: usize) -> Result<Tensor> {
    let shape = broadcast(&x.shape, &y.shape)?;
    let (x, y) = (expanded(x, &shape, most)?.elements(), expanded(y, &shape, most)?.elements());
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
        let [values_x, values_y] = [&x, &y].map(|v| at.iter().filter_map(|&i| value(&v[i])).collect::<Vec<_>>());
        let [known_x, known_y] = [&x, &y].map(|v| at.iter().map(|&i| known(&v[i])).collect::<Vec<f64>>());
        let result = match kind {
            Open::Neither => {
                let f = known::real(op).with_context(|| format!("{op} of constants beside values is not taken"))?;
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
                exprs.elements(result)
            }
        };
        at.into_iter().zip(result).for_each(|(i, element)| all[i] = element);
    }
    Ok(Tensor::of_elements(shape, all))
}

/// `a x + b`; what is multiplied with 0 is known.
fn affine(exprs: &mut Exprs, x: Id, a: Vec<f64>, b: Vec<f64>) -> Result<Vec<Element>> {
    ensure!(a.iter().chain(&b).all(|v| v.is_finite()), "computes with a constant that is not finite, or divides by 0");
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
    let same = super::compare::uniform(y);
    match op {
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
                ("Max", Some(low)) => maximum(exprs, x, low),
                ("Min", Some(high)) => exprs.clip(x, f64::NEG_INFINITY, high),
                _ => {
                    ensure!(op != "Pow", "has several exponents; one for all elements is taken");
                    let sign = if op == "Max" { 1.0 } else { -1.0 };
                    let signs = vec![sign; y.len()];
                    let over = exprs.affine(x, signs.clone(), y.iter().map(|y| -sign * y).collect());
                    let over = exprs.function(Function::Relu, over);
                    exprs.affine(over, signs, y.to_vec())
                }
            };
            Ok(exprs.elements(value))
        }
        _ => bail!("{op} of a value and a constant is not known"),
    }
}

/// `max(x, low)`, which may be a LeakyReLU's half: that is said by [`both`].
fn maximum(exprs: &mut Exprs, x: Id, low: f64) -> Id {
    if low == f64::NEG_INFINITY { x } else { exprs.clip(x, low, f64::INFINITY) }
}

fn known_with(op: &str, exprs: &mut Exprs, x: &[f64], y: Id) -> Result<Vec<Element>> {
    match op {
        "Add" | "Mul" | "Max" | "Min" => with_known(op, exprs, y, x),
        "Sub" => affine(exprs, y, vec![-1.0; x.len()], x.to_vec()),
        "Div" => {
            let reciprocal = exprs.unary(Unary::Reciprocal, y);
            affine(exprs, reciprocal, x.to_vec(), vec![0.0; x.len()])
        }
        _ => bail!("{op} of a constant and a value is not known"),
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
        "Min" => {
            let (x, y) = (exprs.scaled(x, -1.0, 0.0), exprs.scaled(y, -1.0, 0.0));
            let least = exprs.max(x, y);
            exprs.scaled(least, -1.0, 0.0)
        }
        _ => bail!("{op} of two values of the network is not known"),
    })
}

/// `x` to the power p.
fn power(exprs: &mut Exprs, x: Id, p: f64) -> Result<Id> {
    Ok(match p {
        1.0 => x,
        2.0 => exprs.mul(x, x),
        3.0 => {
            let square = exprs.mul(x, x);
            exprs.mul(square, x)
        }
        0.5 => exprs.unary(Unary::Sqrt, x),
        -0.5 => {
            let root = exprs.unary(Unary::Sqrt, x);
            exprs.unary(Unary::Reciprocal, root)
        }
        -1.0 => exprs.unary(Unary::Reciprocal, x),
        _ => bail!("has the exponent {p}; 1, 2, 3, -1 and the square root are taken"),
    })
}
