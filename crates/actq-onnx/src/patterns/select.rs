//! Choices by a value's sign or size, to which exporters decompose activations: `where(x > t, x, f(x))`.

use actq_kernels::math::Function;

use crate::values::compare::near;
use crate::values::expr::{Expr, Exprs, Id, Unary};

/// Operand from which on softplus equals its operand in f32: `ln(1 + e^-15)` is less than half the last digit of 15.
const SOFTPLUS_END: f64 = 15.0;

impl Exprs {
    /// Converts `where(condition, x, y)`, if it is a function of the network.
    pub(crate) fn select(&mut self, condition: Id, x: Id, y: Id) -> Option<Id> {
        let &Expr::Unary(Unary::Above(limit), of) = self.get(condition) else { return None };
        // Softplus above its limit.
        let (softplus, factor, zero) = self.affine_of(y);
        if let Some(z) = self.known_of(softplus, Function::Softplus)
            && zero == 0.0
            && near(self.ratio(x, z)?, factor)
        {
            // A negative factor reverses the comparison: the linear part would replace the curved one.
            let compared = self.ratio(of, z)?;
            if compared > 0.0 && limit / compared >= SOFTPLUS_END {
                return Some(y);
            }
        }
        // All other activations change at zero.
        if limit != 0.0 || self.ratio(of, x)? <= 0.0 {
            return None;
        }
        if let Some(slope) = self.ratio(y, x) {
            let slopes = vec![slope; self.len_of(x)];
            return Some(self.leaky(x, slopes));
        }
        let (power, alpha, minus) = self.affine_of(y);
        let exponent = self.known_of(power, Function::Exp).filter(|_| near(alpha, -minus))?;
        let below = self.at_most(x, 0.0);
        let same = exponent == x || exponent == below;
        same.then(|| self.elu(x, alpha))
    }

    /// Converts `where(condition, x, limit)`, or `where(condition, limit, x)`, if the condition compares x with the
    /// limit.
    pub(crate) fn select_constant(&mut self, condition: Id, x: Id, limit: f64, where_true: bool) -> Option<Id> {
        let &Expr::Unary(Unary::Above(bound), of) = self.get(condition) else { return None };
        // The compared value may already have a limit, on the other side or farther away.
        let compared = self.ratio(of, x).or_else(|| {
            let (inner, low, high) = self.limited(x)?;
            (low..=high).contains(&limit).then(|| self.ratio(of, inner))?
        })?;
        if !near(bound / compared, limit) {
            return None;
        }
        let above = compared > 0.0;
        Some(if above == where_true {
            self.clip(x, limit, f64::INFINITY)
        } else {
            self.clip(x, f64::NEG_INFINITY, limit)
        })
    }
}
