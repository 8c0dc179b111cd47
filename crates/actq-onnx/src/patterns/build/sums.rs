//! Sums.

use actq_kernels::math::Function;

use crate::values::compare::near;
use crate::values::expr::{Expr, Exprs, Id, Unary};

impl Exprs {
    /// Returns `x + y`.
    pub(crate) fn add(&mut self, x: Id, y: Id) -> Id {
        let len = self.len_of(x);
        if x == y {
            return self.scaled(x, 2.0, 0.0);
        }
        if let (&Expr::Spread(p), &Expr::Spread(q)) = (self.get(x), self.get(y)) {
            let one = self.add(p, q);
            return self.put(Expr::Spread(one), len);
        }
        for (p, q) in [(x, y), (y, x)] {
            if let Some((centred, inverse, a, b)) = self.late_centring(p, q) {
                let normed = self.mul(centred, inverse);
                return self.affine(normed, a, b);
            }
            // max(x, 0) + ln(1 + e^-|x|)
            if let Some(z) = self.known_of(p, Function::Relu)
                && let Some(negative) = self.known_of(q, Function::Softplus)
                && let (absolute, -1.0, 0.0) = self.affine_of(negative)
                && self.operand_of(absolute, Unary::Abs) == Some(z)
            {
                return self.function(Function::Softplus, z);
            }
        }
        self.put(Expr::Add(x.min(y), x.max(y)), len)
    }

    /// Finds the norm `a r x + (b - a r mean(x))` of Keras in `p + q`. Returns the deviations `x - mean(x)`, r, a and
    /// b.
    fn late_centring(&mut self, p: Id, q: Id) -> Option<(Id, Id, Vec<f64>, Vec<f64>)> {
        let (product, a, b) = self.split(p);
        let (mean, c, d) = self.split(q);
        let (&Expr::Mul(s, t), &Expr::Spread(mean)) = (self.get(product), self.get(mean)) else { return None };
        let (mean, k, zero) = self.affine_of(mean);
        let &Expr::Mul(m, r) = self.get(mean) else { return None };
        let n = self.len_of(product) as f64;
        for (x, inverse) in [(s, t), (t, s)] {
            let &Expr::Spread(one) = self.get(inverse) else { continue };
            let sum = if m == one { r } else { m };
            let &Expr::Sum(whole) = self.get(sum) else { continue };
            // Factors of the operand have moved out of the product.
            let Some(factors) = self.ratios(whole, x) else { continue };
            if (m != one && r != one) || zero != 0.0 {
                continue;
            }
            let a: Vec<f64> = a.iter().zip(&factors).map(|(a, f)| a / f).collect();
            if a.iter().zip(&c).all(|(a, c)| near(c * k * n, -a)) {
                let mean = self.scaled(sum, -1.0 / n, 0.0);
                let mean = self.put(Expr::Spread(mean), n as usize);
                let centred = self.add(whole, mean);
                return Some((centred, inverse, a, b.iter().zip(&d).map(|(b, d)| b + d).collect()));
            }
        }
        None
    }

    /// Splits an expression into `a x + b`.
    fn split(&self, id: Id) -> (Id, Vec<f64>, Vec<f64>) {
        match self.get(id) {
            Expr::Affine(x, a, b) => (*x, a.clone(), b.clone()),
            _ => (id, vec![1.0; self.len_of(id)], vec![0.0; self.len_of(id)]),
        }
    }

    /// Returns the sum of all elements.
    pub(crate) fn sum(&mut self, x: Id) -> Id {
        if self.len_of(x) == 1 {
            return x;
        }
        if let &Expr::Spread(one) = self.get(x) {
            return self.scaled(one, self.len_of(x) as f64, 0.0);
        }
        self.put(Expr::Sum(x), 1)
    }
}
