//! Evaluation of expressions for known numbers, which folds layers with a constant input.

use std::collections::HashMap;

use actq::error::{Context as _, Result};
use actq_kernels::math::Function;

use crate::values::expr::{Expr, Exprs, Id, Unary};

/// Evaluates `f` for these numbers.
pub(crate) fn computed(values: &[f64], f: &dyn Fn(&mut Exprs, Id) -> Id) -> Result<Vec<f64>> {
    if values.is_empty() {
        return Ok(Vec::new());
    }
    let mut exprs = Exprs::default();
    let x = exprs.put(Expr::Input(0), values.len());
    let y = f(&mut exprs, x);
    exprs.evaluated(y, values).context("cannot be evaluated for constants; let the exporter fold constants")
}

impl Exprs {
    /// Evaluates `root` for `input`, the only input; `None` if it depends on a matrix, a cell or another expression
    /// that has no arm here.
    fn evaluated(&self, root: Id, input: &[f64]) -> Option<Vec<f64>> {
        let mut values: HashMap<Id, Vec<f64>> = HashMap::new();
        for id in self.needed(&[root]) {
            let of = |x: &Id| values.get(x).map(Vec::as_slice);
            let both = |x: &Id, y: &Id, f: fn((&f64, &f64)) -> f64| Some(of(x)?.iter().zip(of(y)?).map(f).collect());
            let value: Vec<f64> = match self.get(id) {
                Expr::Input(_) => input.to_vec(),
                Expr::Pick(runs) => {
                    let runs = runs.iter().map(|run| of(&run.of)?.get(run.from..run.from + run.len));
                    runs.collect::<Option<Vec<_>>>()?.concat()
                }
                Expr::Spread(x) => vec![*of(x)?.first()?; self.len_of(id)],
                Expr::Affine(x, a, b) => of(x)?.iter().zip(a).zip(b).map(|((x, a), b)| a * x + b).collect(),
                Expr::Unary(f, x) => of(x)?.iter().map(|&v| f.of(v)).collect(),
                Expr::Add(x, y) => both(x, y, |(x, y)| x + y)?,
                Expr::Mul(x, y) => both(x, y, |(x, y)| x * y)?,
                Expr::Sum(x) => vec![of(x)?.iter().sum()],
                Expr::Clip(x, limit) => of(x)?.iter().map(|v| v.clamp(-limit, *limit)).collect(),
                Expr::LayerNorm(x, weight, bias, eps) => {
                    let x = of(x)?;
                    let mean = x.iter().sum::<f64>() / x.len() as f64;
                    let centred: Vec<f64> = x.iter().map(|v| v - mean).collect();
                    let s = inverse_root(&centred, *eps);
                    centred.iter().zip(weight).zip(bias).map(|((v, w), b)| v * s * w + b).collect()
                }
                Expr::RmsNorm(x, weight, eps) => {
                    let s = inverse_root(of(x)?, *eps);
                    of(x)?.iter().zip(weight).map(|(v, w)| v * s * w).collect()
                }
                Expr::Rotary(rotary) => {
                    let half = rotary.cos.len();
                    let rotated = |head: &[f64]| {
                        let (x, y) = head.split_at(half);
                        let by = |a: &[f64], b: &[f64], sign: f64| -> Vec<f64> {
                            (0..half).map(|i| a[i] * rotary.cos[i] + sign * b[i] * rotary.sin[i]).collect()
                        };
                        [by(x, y, -1.0), by(y, x, 1.0)].concat()
                    };
                    of(&rotary.x)?.chunks_exact(2 * half).flat_map(rotated).collect()
                }
                _ => return None,
            };
            values.insert(id, value);
        }
        values.remove(&root)
    }
}

/// Returns `1 / sqrt(mean(x^2) + eps)`.
fn inverse_root(x: &[f64], eps: f64) -> f64 {
    let square = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
    1.0 / (square + eps).sqrt()
}

impl Unary {
    fn of(self, x: f64) -> f64 {
        match self {
            Self::Known(function) => value(function, x),
            Self::Log => libm::log(x),
            Self::Sqrt => x.sqrt(),
            Self::Erf => libm::erf(x),
            Self::Reciprocal => 1.0 / x,
            Self::Abs => x.abs(),
            Self::Above(limit) => f64::from(u8::from(x > limit)),
        }
    }
}

/// Evaluates a function of the network in f64.
fn value(function: Function, x: f64) -> f64 {
    let sigmoid = |x: f64| 1.0 / (1.0 + libm::exp(-x));
    let softplus = |x: f64| x.max(0.0) + libm::log1p(libm::exp(-x.abs()));
    match function {
        Function::Relu => x.max(0.0),
        Function::Elu => x.max(0.0) + libm::expm1(x.min(0.0)),
        Function::Silu => x * sigmoid(x),
        Function::Gelu => x * 0.5 * libm::erfc(-x / 2f64.sqrt()),
        Function::GeluTanh => x * sigmoid(2.0 * (2.0 / std::f64::consts::PI).sqrt() * (x + 0.044_715 * (x * x * x))),
        Function::Tanh => libm::tanh(x),
        Function::Sigmoid => sigmoid(x),
        Function::Exp => libm::exp(x),
        Function::Sin => libm::sin(x),
        Function::Cos => libm::cos(x),
        Function::Softplus => softplus(x),
        Function::Mish => x * libm::tanh(softplus(x)),
    }
}
