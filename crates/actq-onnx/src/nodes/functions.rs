//! Operators with one operand, and limits.

use actq::error::{Context as _, Result, ensure};
use actq_kernels::math::Function;

use crate::nodes::call::Call;
use crate::values::elements::each;
use crate::values::expr::{Exprs, Id, Unary};
use crate::values::tensor::Tensor;

/// A function of all elements of a vector.
type OnVector = Box<dyn Fn(&mut Exprs, Id) -> Id>;

/// Converts a function of one value.
pub(crate) fn one(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
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
            ensure!(alpha > 0.0, "has alpha {alpha}; only one above 0 is supported");
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
            ensure!(low <= high, "limits to {low} .. {high}; the lower limit exceeds the upper one");
            let x = call.input(0)?;
            return each(exprs, x, &|exprs, x| exprs.clip(x, low, high)).map(Some);
        }
        _ => return Ok(None),
    };
    each(exprs, call.input(0)?, &*open).map(Some)
}

/// Returns `x sigmoid(k x)`.
fn gate(k: f64) -> OnVector {
    Box::new(move |exprs, x| {
        if k == 0.0 {
            return exprs.scaled(x, 0.5, 0.0);
        }
        let scaled = exprs.scaled(x, k, 0.0);
        let silu = exprs.function(Function::Silu, scaled);
        exprs.scaled(silu, 1.0 / k, 0.0)
    })
}

/// Returns `gamma x` if x is positive, else `gamma alpha (exp(x) - 1)`.
fn elu(alpha: f64, gamma: f64) -> OnVector {
    Box::new(move |exprs, x| {
        let elu = exprs.elu(x, alpha);
        exprs.scaled(elu, gamma, 0.0)
    })
}

fn hard_sigmoid(exprs: &mut Exprs, x: Id, slope: f64, middle: f64) -> Id {
    let line = exprs.scaled(x, slope, middle);
    exprs.clip(line, 0.0, 1.0)
}

/// Returns the limits of a Clip: attributes before operator set 11, inputs since.
fn limits(call: &Call<'_>) -> Result<(f64, f64)> {
    let limit = |i: usize, name: &str, none: f64| match (call.float(name), call.optional(i)) {
        (Some(limit), _) => Ok(limit),
        (None, None) => Ok(none),
        (None, Some(_)) => {
            let values = call.reals(i, "a limit")?;
            values.first().copied().context("a limit has no value")
        }
    };
    Ok((limit(1, "min", f64::NEG_INFINITY)?, limit(2, "max", f64::INFINITY)?))
}
