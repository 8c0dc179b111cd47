//! Functions of every element.

use actq_kernels::math::Function;

use crate::values::compare::uniform;
use crate::values::expr::{Expr, Exprs, Id, Unary};

impl Exprs {
    /// Applies a function of the network.
    pub(crate) fn function(&mut self, function: Function, x: Id) -> Id {
        self.unary(Unary::Known(function), x)
    }

    /// Applies a function to every element.
    pub(crate) fn unary(&mut self, f: Unary, x: Id) -> Id {
        let len = self.len_of(x);
        if let &Expr::Spread(one) = self.get(x) {
            let one = self.unary(f, one);
            return self.put(Expr::Spread(one), len);
        }
        let (inner, a, b) = self.affine_of(x);
        let exponent = self.known_of(inner, Function::Exp);
        match (f, exponent.or(self.known_of(x, Function::Sigmoid))) {
            // ln(1 + e^x)
            (Unary::Log, Some(x)) if exponent.is_some() && a == 1.0 && b == 1.0 => self.function(Function::Softplus, x),
            // ln(1 / (1 + e^-x))
            (Unary::Log, Some(x)) if exponent.is_none() => {
                let negative = self.scaled(x, -1.0, 0.0);
                let softplus = self.function(Function::Softplus, negative);
                self.scaled(softplus, -1.0, 0.0)
            }
            // 1 / (a + a e^x)
            (Unary::Reciprocal, Some(x)) if exponent.is_some() && a == b => {
                let negative = self.scaled(x, -1.0, 0.0);
                let sigmoid = self.function(Function::Sigmoid, negative);
                self.scaled(sigmoid, 1.0 / a, 0.0)
            }
            (Unary::Reciprocal, _) if a != 1.0 && b == 0.0 => {
                let reciprocal = self.unary(f, inner);
                self.scaled(reciprocal, 1.0 / a, 0.0)
            }
            _ => self.put(Expr::Unary(f, x), len),
        }
    }

    /// Returns `x` if positive, else `alpha (exp(x) - 1)`, as `alpha (elu(x) + (1 / alpha - 1) relu(x))`.
    pub(crate) fn elu(&mut self, x: Id, alpha: f64) -> Id {
        let (elu, relu) = (self.function(Function::Elu, x), self.function(Function::Relu, x));
        match alpha {
            0.0 => relu,
            1.0 => elu,
            alpha => {
                let relu = self.scaled(relu, 1.0 / alpha - 1.0, 0.0);
                let sum = self.add(elu, relu);
                self.scaled(sum, alpha, 0.0)
            }
        }
    }

    /// Returns `x` if positive, else `slope x`, with a slope for each element.
    pub(crate) fn leaky(&mut self, x: Id, slope: Vec<f64>) -> Id {
        let positive = self.function(Function::Relu, x);
        if let Some(slope) = uniform(&slope)
            && slope < 1.0
        {
            let all = self.scaled(x, slope / (1.0 - slope), 0.0);
            let sum = self.add(positive, all);
            return self.scaled(sum, 1.0 - slope, 0.0);
        }
        let rest: Vec<f64> = slope.iter().map(|s| 1.0 - s).collect();
        let zeros = vec![0.0; slope.len()];
        let (positive, all) = (self.affine(positive, rest, zeros.clone()), self.affine(x, slope, zeros));
        self.add(positive, all)
    }
}
