//! Recognition of norms in sums, roots and quotients.

use actq_kernels::math::Function;

use crate::patterns::totals::Total;
use crate::values::compare::near;
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Unary};

/// `factor v / sqrt(mean(v^2) + eps)`, where v may be the deviations of another value from its mean.
pub(crate) struct Norm {
    pub(crate) factor: f64,
    pub(crate) eps: f64,
    /// The value whose mean is subtracted first, if any.
    pub(crate) centred: Option<Id>,
}

/// The least epsilon, the smallest normal number of f32.
const MIN_EPS: f64 = 1.2e-38;
/// The largest epsilon after a factor has moved out of a norm.
const MAX_EPS: f64 = 1.0;
/// Largest limit in a division by `max(length, limit)`; vectors must be much longer than it.
const MAX_LIMIT: f64 = 1e-8;

impl Exprs {
    /// Finds the norm of `v` in `v * s`, for an s of one element.
    pub(crate) fn norm(&self, v: Id, s: Id) -> Option<Norm> {
        let n = self.len_of(v) as f64;
        let (root, factor, zero) = self.affine_of(s);
        let root = self.operand_of(root, Unary::Reciprocal).filter(|_| zero == 0.0)?;
        // `max(length, limit)` is `relu(length - limit) + limit`.
        let (root, limit) = match self.affine_of(root) {
            (relu, 1.0, limit) if limit > 0.0 && self.known_of(relu, Function::Relu).is_some() => {
                let (root, one, off) = self.affine_of(self.known_of(relu, Function::Relu)?);
                if one != 1.0 || !near(-off, limit) || limit > MAX_LIMIT {
                    return None;
                }
                (root, limit)
            }
            // `length + limit` differs from that by at most the limit.
            (root, 1.0, limit) if (0.0..=MAX_LIMIT).contains(&limit) => (root, limit),
            _ => (root, 0.0),
        };
        let (square, a, e) = self.affine_of(self.operand_of(root, Unary::Sqrt)?);
        // Rounding may make a variance negative, and some files limit it to 0.
        let limited = self.known_of(square, Function::Relu);
        let square = self.total(limited.unwrap_or(square));
        let centred = self.centred(v);
        let multiple = square.over(&self.sum_of_squares(v));
        let (k, rest) = multiple.or_else(|| self.variance(square, centred?))?;
        // The operand of the root is `scale mean(v^2) + added`.
        let (scale, added) = (a * k * n, a * rest + e + limit * limit);
        if scale <= 0.0 || added < 0.0 || limited.is_some() && (k < 0.0 || rest < 0.0) {
            return None;
        }
        Some(Norm { factor: factor / scale.sqrt(), eps: (added / scale).max(MIN_EPS), centred })
    }

    /// Returns the u for which `v = u - mean(u)`.
    fn centred(&self, v: Id) -> Option<Id> {
        let &Expr::Add(x, y) = self.get(v) else { return None };
        [(x, y), (y, x)].into_iter().find(|&(u, mean)| self.is_negative_mean(mean, u)).map(|(u, _)| u)
    }

    fn is_negative_mean(&self, mean: Id, u: Id) -> bool {
        let &Expr::Spread(mean) = self.get(mean) else { return false };
        let n = self.len_of(u) as f64;
        self.total(mean).over(&self.sum_of_elements(u)).is_some_and(|(k, rest)| near(k * n, -1.0) && rest == 0.0)
    }

    /// Returns the k and the rest of a square that is `k (sum(u^2) - sum(u)^2 / n) + rest`, the variance as mean square
    /// minus squared mean.
    fn variance(&self, mut square: Total, u: Id) -> Option<(f64, f64)> {
        let (sum, of_square) = square.take_square_of_sum(self)?;
        let (k, rest) = square.over(&self.sum_of_squares(u))?;
        let (of_sum, none) = self.total(sum).over(&self.sum_of_elements(u))?;
        let n = self.len_of(u) as f64;
        (none == 0.0 && near(of_square * of_sum * of_sum * n, -k)).then_some((k, rest))
    }

    /// Removes a common factor from the operand of a norm. Returns the operand, the factor's sign, and the new epsilon.
    fn unscaled(&self, x: Id, eps: f64) -> (Id, f64, f64) {
        let (of, k, _) = self.affine_of(x);
        let eps_of = eps / (k * k);
        if (MIN_EPS..=MAX_EPS).contains(&eps_of) { (of, k.signum(), eps_of) } else { (x, 1.0, eps) }
    }

    /// Returns the layer norm of `x`. A common offset of all elements cancels, as it is in the mean, too.
    pub(crate) fn layer_norm(&mut self, x: Id, weight: &[f64], bias: Vec<f64>, eps: f64) -> Id {
        let (of, sign, eps) = self.unscaled(x, eps);
        let weight = weight.iter().map(|w| sign * w).collect();
        self.put(Expr::LayerNorm(of, weight, bias, eps), self.len_of(x))
    }

    /// Returns the RMS norm of `x`. Constant zeros are removed, and the weight corrects the mean over fewer elements.
    pub(crate) fn rms_norm(&mut self, x: Id, weight: &[f64], eps: f64) -> Id {
        let (of, sign, eps) = if self.affine_of(x).2 == 0.0 { self.unscaled(x, eps) } else { (x, 1.0, eps) };
        let mut elements: Vec<(Id, usize)> = self.elements(of).iter().filter_map(value).collect();
        let parts = self.parts(of);
        let open: Vec<usize> = (0..parts.len()).filter(|&i| !parts[i].is_zero()).collect();
        if open.is_empty() {
            return of;
        }
        let share = open.len() as f64 / parts.len() as f64;
        let open_of = self.vector(&open.iter().map(|&i| elements[i]).collect::<Vec<_>>());
        let weight = open.iter().map(|&i| sign * weight[i] / share.sqrt()).collect();
        let norm = self.put(Expr::RmsNorm(open_of, weight, eps / share), open.len());
        open.iter().enumerate().for_each(|(k, &i)| elements[i] = (norm, k));
        self.vector(&elements)
    }
}
