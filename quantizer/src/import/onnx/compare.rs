//! Whether expressions are the same but for factors, which is what patterns ask.

use std::mem::discriminant;

use actq_kernels::math::Function;

use super::expr::{Expr, Exprs, Id, Unary};

/// Exporters write constants such as `sqrt(2)` in f32.
const TOLERANCE: f64 = 2e-6;

/// Equal, as far as f32 tells.
pub(super) fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

/// The one value of a vector.
pub(super) fn uniform(values: &[f64]) -> Option<f64> {
    let first = *values.first()?;
    values.iter().all(|v| *v == first).then_some(first)
}

impl Exprs {
    /// `a x + b` with the same a and b for all elements; of any other expression `1 x + 0`.
    pub(super) fn affine_of(&self, id: Id) -> (Id, f64, f64) {
        if let Expr::Affine(x, a, b) = self.get(id)
            && let (Some(a), Some(b)) = (uniform(a), uniform(b))
        {
            return (*x, a, b);
        }
        (id, 1.0, 0.0)
    }

    /// The operand of a function.
    pub(super) fn operand_of(&self, id: Id, function: Unary) -> Option<Id> {
        if let Expr::Unary(f, x) = self.get(id) { (*f == function).then_some(*x) } else { None }
    }

    /// As [`Self::operand_of`].
    pub(super) fn known_of(&self, id: Id, function: Function) -> Option<Id> {
        self.operand_of(id, Unary::Known(function))
    }

    /// The operand of a sum of squares.
    pub(super) fn squares_of(&self, id: Id) -> Option<Id> {
        let &Expr::Sum(product) = self.get(id) else { return None };
        if let &Expr::Mul(x, y) = self.get(product) { (x == y).then_some(x) } else { None }
    }

    /// The k for which `y = k x`.
    pub(super) fn ratio(&self, y: Id, x: Id) -> Option<f64> {
        if y == x {
            return Some(1.0);
        }
        let zeros = vec![0.0; self.len_of(x)];
        // Factors and offsets may have gone into a norm.
        let split = |id: Id| match self.get(id) {
            Expr::Affine(of, a, b) => (*of, None, Some((a, b))),
            expr @ Expr::LayerNorm(of, a, b, eps) => (*of, Some((discriminant(expr), *eps)), Some((a, b))),
            expr @ Expr::RmsNorm(of, a, eps) => (*of, Some((discriminant(expr), *eps)), Some((a, &zeros))),
            _ => (id, None, None),
        };
        let at = |parts: Option<(&Vec<f64>, &Vec<f64>)>, i: usize| parts.map_or((1.0, 0.0), |(a, b)| (a[i], b[i]));
        let ((of_y, norm_y, y), (of_x, norm_x, x)) = (split(y), split(x));
        if of_y != of_x || norm_y != norm_x {
            return None;
        }
        let k = at(y, 0).0 / at(x, 0).0;
        let same = |i: usize| near(at(y, i).0, k * at(x, i).0) && near(at(y, i).1, k * at(x, i).1);
        (k.is_finite() && k != 0.0 && (0..self.len_of(of_y)).all(same)).then_some(k)
    }

    /// The coefficients of `y` as a polynomial in `x`, from the constant one on, up to the cube.
    pub(super) fn polynomial(&self, y: Id, x: Id, depth: usize) -> Option<[f64; 4]> {
        if depth == 0 {
            return None;
        }
        if let Some(k) = self.ratio(y, x) {
            return Some([0.0, k, 0.0, 0.0]);
        }
        match *self.get(y) {
            Expr::Affine(of, ..) => {
                let (same, a, b) = self.affine_of(y);
                let inner = if same == of { self.polynomial(of, x, depth - 1)? } else { return None };
                Some([a * inner[0] + b, a * inner[1], a * inner[2], a * inner[3]])
            }
            Expr::Add(p, q) => {
                let (p, q) = (self.polynomial(p, x, depth - 1)?, self.polynomial(q, x, depth - 1)?);
                Some([0, 1, 2, 3].map(|i| p[i] + q[i]))
            }
            Expr::Mul(p, q) => {
                let (p, q) = (self.polynomial(p, x, depth - 1)?, self.polynomial(q, x, depth - 1)?);
                let mut product = [0.0; 4];
                for (i, p) in p.into_iter().enumerate() {
                    for (j, q) in q.into_iter().enumerate() {
                        match product.get_mut(i + j) {
                            Some(sum) => *sum += p * q,
                            None if p * q == 0.0 => {}
                            None => return None,
                        }
                    }
                }
                Some(product)
            }
            _ => None,
        }
    }
}
