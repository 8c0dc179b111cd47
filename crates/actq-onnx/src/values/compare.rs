//! Comparison of expressions up to factors, for the recognition of patterns.

use actq_kernels::math::Function;

use crate::values::expr::{Expr, Exprs, Id, Unary};

/// Relative tolerance of constants, as exporters round those such as `sqrt(2)` to f32.
const TOLERANCE: f64 = 2e-6;

/// Returns `true` if the values are equal within [`TOLERANCE`].
pub(crate) fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

/// Rounds to a power of two within [`TOLERANCE`], as exporters write one as the quotient of rounded constants.
pub(crate) fn exact(k: f64) -> f64 {
    let power = libm::exp2(libm::log2(k.abs()).round()).copysign(k);
    if near(power, k) { power } else { k }
}

/// Returns the value that all elements of a vector have.
pub(crate) fn uniform(values: &[f64]) -> Option<f64> {
    let first = *values.first()?;
    values.iter().all(|v| *v == first).then_some(first)
}

impl Exprs {
    /// Splits an expression into `a x + b` with one a and b for all elements; any other expression is `1 x + 0`.
    pub(crate) fn affine_of(&self, id: Id) -> (Id, f64, f64) {
        if let Expr::Affine(x, a, b) = self.get(id)
            && let (Some(a), Some(b)) = (uniform(a), uniform(b))
        {
            return (*x, a, b);
        }
        (id, 1.0, 0.0)
    }

    /// Returns the operand, if the expression is this function.
    pub(crate) fn operand_of(&self, id: Id, function: Unary) -> Option<Id> {
        if let Expr::Unary(f, x) = self.get(id) { (*f == function).then_some(*x) } else { None }
    }

    /// Returns the same as [`Self::operand_of`], for a function of the network.
    pub(crate) fn known_of(&self, id: Id, function: Function) -> Option<Id> {
        self.operand_of(id, Unary::Known(function))
    }

    /// Returns the coefficients of each element of `y` as a polynomial of degree 3 in that of `x`, constant first.
    pub(crate) fn polynomials(&self, y: Id, x: Id, depth: usize) -> Option<Vec<[f64; 4]>> {
        let depth = depth.checked_sub(1)?;
        if let Some(ratios) = self.ratios(y, x) {
            return Some(ratios.into_iter().map(|k| [0.0, k, 0.0, 0.0]).collect());
        }
        match self.get(y) {
            Expr::Affine(of, a, b) => {
                let one = |((p, a), b): (([f64; 4], &f64), &f64)| [a * p[0] + b, a * p[1], a * p[2], a * p[3]];
                Some(self.polynomials(*of, x, depth)?.into_iter().zip(a).zip(b).map(one).collect())
            }
            Expr::Add(p, q) => {
                let pairs = self.polynomials(*p, x, depth)?.into_iter().zip(self.polynomials(*q, x, depth)?);
                Some(pairs.map(|(p, q)| [0, 1, 2, 3].map(|i| p[i] + q[i])).collect())
            }
            Expr::Mul(p, q) => {
                let pairs = self.polynomials(*p, x, depth)?.into_iter().zip(self.polynomials(*q, x, depth)?);
                pairs.map(|(p, q)| product(p, q)).collect()
            }
            _ => None,
        }
    }
}

/// Multiplies two polynomials; `None` above degree 3.
fn product(p: [f64; 4], q: [f64; 4]) -> Option<[f64; 4]> {
    let mut product = [0.0; 4];
    for (i, p) in p.into_iter().enumerate() {
        for (j, q) in q.into_iter().enumerate().filter(|(_, q)| p * q != 0.0) {
            *product.get_mut(i + j)? += p * q;
        }
    }
    Some(product)
}
