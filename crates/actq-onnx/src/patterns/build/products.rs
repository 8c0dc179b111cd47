//! Products, with the gates and norms that are products.

use actq_kernels::math::Function;

use crate::patterns::norm::Norm;
use crate::values::compare::{exact, near, uniform};
use crate::values::expr::{Expr, Exprs, Id, Unary};

/// The most nested expressions of a polynomial.
const DEPTH: usize = 12;
/// The two coefficients of GELU's tanh form: `sqrt(2 / pi)`, and that times 0.044715.
const GELU_TANH: [f64; 2] = [0.797_884_560_802_865_4, 0.035_677_408_136_300_125];

/// `factor function(scale of)`
struct Gated {
    function: Function,
    of: Id,
    scale: f64,
    factor: f64,
}

impl Exprs {
    /// Returns `x y`.
    pub(crate) fn mul(&mut self, x: Id, y: Id) -> Id {
        let len = self.len_of(x);
        if let (&Expr::Spread(p), &Expr::Spread(q)) = (self.get(x), self.get(y)) {
            let one = self.mul(p, q);
            return self.put(Expr::Spread(one), len);
        }
        for (p, q) in [(x, y), (y, x)] {
            if let Some(Gated { function, of, scale, factor }) = self.gated(p, q) {
                let of = self.scaled(of, scale, 0.0);
                let value = self.function(function, of);
                return self.scaled(value, factor, 0.0);
            }
        }
        for (p, q) in [(x, y), (y, x)] {
            // A common factor of all elements is a factor of the norm.
            let (of, k) = if let (of, k, 0.0) = self.affine_of(p) { (of, k) } else { (p, 1.0) };
            if let &Expr::Spread(one) = self.get(q)
                && let Some(norm) = self.norm(of, one)
            {
                return self.normed(of, k, &norm);
            }
        }
        // Factors move out of the product. Those of a repeated root move first, as the factors of its operand are in
        // the root's squares, too.
        let of_spread =
            |id: Id| matches!(self.get(id), Expr::Affine(of, ..) if matches!(self.get(*of), Expr::Spread(_)));
        let (p, q) = if of_spread(y) { (y, x) } else { (x, y) };
        for (p, q) in [(p, q), (q, p)] {
            if let Expr::Affine(of, a, b) = self.get(p)
                && uniform(b) == Some(0.0)
                && (x != y || uniform(a).is_some())
            {
                let (of, a, b) = (*of, a.clone(), b.clone());
                let product = self.mul(of, q);
                return self.affine(product, a, b);
            }
        }
        self.put(Expr::Mul(x.min(y), x.max(y)), len)
    }

    /// Returns `k` times a norm.
    fn normed(&mut self, v: Id, k: f64, norm: &Norm) -> Id {
        let len = self.len_of(v);
        let weight = vec![k * norm.factor; len];
        match norm.centred {
            Some(of) => self.layer_norm(of, &weight, vec![0.0; len], norm.eps),
            None => self.rms_norm(v, &weight, norm.eps),
        }
    }

    /// Finds a function in `p q` that multiplies its operand with a gate: SiLU, GELU, Mish.
    fn gated(&self, p: Id, q: Id) -> Option<Gated> {
        // f(s) / k, as p is s / k.
        let of_gate = |function: Function, s: Id| {
            let factor = 1.0 / self.ratio(s, p)?;
            Some(Gated { function, of: s, scale: 1.0, factor })
        };
        if let Some(s) = self.known_of(q, Function::Sigmoid) {
            return of_gate(Function::Silu, s);
        }
        if let Some(tanh) = self.known_of(q, Function::Tanh)
            && let Some(s) = self.known_of(tanh, Function::Softplus)
        {
            return of_gate(Function::Mish, s);
        }
        // p (b + b gate), or p (b - b gate) with the gate's operand negated, as both gates are odd.
        let (gate, a, b) = self.affine_of(q);
        if a.abs() != b.abs() {
            return None;
        }
        let (function, scale) = if let Some(u) = self.operand_of(gate, Unary::Erf) {
            (Function::Gelu, self.ratio(u, p)? * 2f64.sqrt())
        } else {
            (Function::GeluTanh, self.gelu_scale(self.known_of(gate, Function::Tanh)?, p)?)
        };
        let scale = exact(a / b * scale);
        Some(Gated { function, of: p, scale, factor: 2.0 * b / scale })
    }

    /// Returns the k for which `u` is the polynomial of `k p` in GELU's tanh form.
    fn gelu_scale(&self, u: Id, p: Id) -> Option<f64> {
        let polynomials = self.polynomials(u, p, DEPTH)?;
        let k = polynomials.first()?[1] / GELU_TANH[0];
        let expected = [0.0, GELU_TANH[0] * k, 0.0, GELU_TANH[1] * (k * k * k)];
        let is_gelu = |found: &[f64; 4]| found.iter().zip(expected).all(|(found, expected)| near(*found, expected));
        polynomials.iter().all(is_gelu).then_some(k)
    }
}
