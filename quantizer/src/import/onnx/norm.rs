//! Norms out of sums, roots and quotients.

use actq_kernels::math::Function;

use super::compare::near;
use super::expr::{Expr, Exprs, Id, Unary};

/// `factor v / sqrt(mean(v^2) + eps)`, where v may be the deviations of another value from its mean.
pub(super) struct Norm {
    pub(super) factor: f64,
    pub(super) eps: f64,
    /// The value whose mean is taken off first.
    pub(super) centred: Option<Id>,
}

/// The least that is added to a mean square: f32 has no smaller normal number.
const LEAST_EPS: f64 = 1.2e-38;
/// The longest vector that is divided by `max(its length, limit)` is much longer than this limit, or it is not taken.
const MOST_LIMIT: f64 = 1e-8;

impl Exprs {
    /// Whether `v * s` is a norm of `v`, for an s of one element.
    pub(super) fn norm(&self, v: Id, s: Id) -> Option<Norm> {
        let n = self.len_of(v) as f64;
        let (root, factor, zero) = self.affine_of(s);
        let root = self.operand_of(root, Unary::Reciprocal).filter(|_| zero == 0.0)?;
        // `max(length, limit)` is `relu(length - limit) + limit`.
        let (root, limit) = match self.affine_of(root) {
            (relu, 1.0, limit) if limit > 0.0 && self.known_of(relu, Function::Relu).is_some() => {
                let (root, one, off) = self.affine_of(self.known_of(relu, Function::Relu)?);
                if one != 1.0 || !near(-off, limit) || limit > MOST_LIMIT {
                    return None;
                }
                (root, limit)
            }
            // `length + limit` is off that by no more than the limit.
            (root, 1.0, limit) if (0.0..=MOST_LIMIT).contains(&limit) => (root, limit),
            _ => (root, 0.0),
        };
        let (square, a, e) = self.affine_of(self.operand_of(root, Unary::Sqrt)?);
        if a <= 0.0 || e < 0.0 {
            return None;
        }
        let eps = |scale: f64| ((e + limit * limit) / (a * scale)).max(LEAST_EPS);
        let centred = self.centred(v);
        if let Some(z) = self.squares_of(square) {
            // The sum of z^2 is k^2 times that of v^2.
            let k = self.ratio(z, v)?;
            let scale = n * k * k;
            return Some(Norm { factor: factor / (a * scale).sqrt(), eps: eps(scale), centred });
        }
        // The variance as mean square less squared mean.
        let u = centred?;
        self.is_variance(square, u, n).then(|| Norm { factor: factor / a.sqrt(), eps: eps(1.0), centred })
    }

    /// The u for which `v = u - mean(u)`.
    fn centred(&self, v: Id) -> Option<Id> {
        let &Expr::Add(x, y) = self.get(v) else { return None };
        [(x, y), (y, x)].into_iter().find(|&(u, mean)| self.is_mean(mean, u, -1.0)).map(|(u, _)| u)
    }

    fn is_mean(&self, mean: Id, u: Id, sign: f64) -> bool {
        let &Expr::Spread(mean) = self.get(mean) else { return false };
        let (sum, a, b) = self.affine_of(mean);
        *self.get(sum) == Expr::Sum(u) && b == 0.0 && near(a * self.len_of(u) as f64, sign)
    }

    /// Whether `square` is `mean(u^2) - mean(u)^2`, or the larger of that and 0.
    fn is_variance(&self, square: Id, u: Id, n: f64) -> bool {
        let square = self.known_of(square, Function::Relu).unwrap_or(square);
        let &Expr::Add(x, y) = self.get(square) else { return false };
        [(x, y), (y, x)].into_iter().any(|(first, second)| {
            let ((squares, a, b), (mean, c, d)) = (self.affine_of(first), self.affine_of(second));
            let &Expr::Mul(p, q) = self.get(mean) else { return false };
            let sums = p == q && *self.get(p) == Expr::Sum(u);
            self.squares_of(squares) == Some(u)
                && sums
                && b == 0.0
                && d == 0.0
                && near(a * n, 1.0)
                && near(c * n * n, -1.0)
        })
    }
}
