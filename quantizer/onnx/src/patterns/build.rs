//! Constructors of expressions, which recognize activations and norms that exporters decompose.

use std::sync::Arc;

use actq_kernels::math::Function;

use crate::patterns::norm::Norm;
use crate::patterns::parts::Part;
use crate::values::compare::{exact, near, uniform};
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Matrix, Run, Unary};
use crate::values::tensor::Element;

/// The most nested expressions of a polynomial.
const DEPTH: usize = 12;
/// The two coefficients of GELU's tanh form: `sqrt(2 / pi)`, and that times 0.044715.
const GELU_TANH: [f64; 2] = [0.797_884_560_802_865_4, 0.035_677_408_136_300_125];
/// Largest limit of a clip that becomes one operation about its middle; beyond it, the offset would cost digits.
const MOST_CLIP: f64 = 100.0;
/// Largest distance of a limit from zero at which it is subtracted and added again; beyond it, small values would lose
/// digits.
const FAR_LIMIT: f64 = 1.0;

/// `factor function(scale of)`
struct Gated {
    function: Function,
    of: Id,
    scale: f64,
    factor: f64,
}

impl Exprs {
    /// Makes a vector of elements of other expressions.
    pub(crate) fn vector(&mut self, elements: &[(Id, usize)]) -> Id {
        let mut runs: Vec<Run> = Vec::new();
        for &(of, at) in elements {
            match runs.last_mut() {
                Some(run) if run.of == of && run.from + run.len == at => run.len += 1,
                _ => runs.push(Run { of, from: at, len: 1 }),
            }
        }
        match runs[..] {
            [Run { of, from: 0, len }] if len == self.len_of(of) => of,
            [first, ..] if elements.len() > 1 && elements.iter().all(|e| *e == elements[0]) => {
                let one = self.lone(first.of, first.from).unwrap_or_else(|| self.vector(&elements[..1]));
                self.put(Expr::Spread(one), elements.len())
            }
            _ => self.put(Expr::Pick(runs), elements.len()),
        }
    }

    /// Returns the elements of an expression, or those of the values that it only moves.
    pub(crate) fn elements(&self, id: Id) -> Vec<Element> {
        match self.get(id) {
            Expr::Spread(one) => vec![Element::Of(*one, 0); self.len_of(id)],
            Expr::Pick(runs) => {
                runs.iter().flat_map(|run| (run.from..run.from + run.len).map(|i| Element::Of(run.of, i))).collect()
            }
            _ => (0..self.len_of(id)).map(|i| Element::Of(id, i)).collect(),
        }
    }

    /// Returns the same as [`Self::elements`], with constants as known elements.
    pub(crate) fn known_elements(&self, id: Id) -> Vec<Element> {
        let known = |(element, part): (Element, Part)| match part.source {
            Some(_) => element,
            None => Element::Known(part.offset),
        };
        self.elements(id).into_iter().zip(self.parts(id)).map(known).collect()
    }

    /// Returns `a x + b`, with the same a and b for all elements.
    pub(crate) fn scaled(&mut self, x: Id, a: f64, b: f64) -> Id {
        let n = self.len_of(x);
        self.affine(x, vec![a; n], vec![b; n])
    }

    /// Returns `a x + b`.
    pub(crate) fn affine(&mut self, x: Id, a: Vec<f64>, b: Vec<f64>) -> Id {
        let len = self.len_of(x);
        let (ones, zeros) = (uniform(&a) == Some(1.0), uniform(&b) == Some(0.0));
        if ones && zeros {
            return x;
        }
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).collect::<Vec<f64>>();
        let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x + y).collect::<Vec<f64>>();
        match self.get(x) {
            Expr::Affine(of, a0, b0) => {
                let (of, a0, b0) = (*of, product(a0, &a), sum(&product(b0, &a), &b));
                self.affine(of, a0, b0)
            }
            Expr::Linear(of, w, bias) if ones => {
                let linear = Expr::Linear(*of, Arc::clone(w), sum(bias, &b));
                self.put(linear, len)
            }
            Expr::LayerNorm(of, weight, bias, eps) => {
                let norm = Expr::LayerNorm(*of, product(weight, &a), sum(&product(bias, &a), &b), *eps);
                self.put(norm, len)
            }
            Expr::RmsNorm(of, weight, eps) if zeros => {
                let norm = Expr::RmsNorm(*of, product(weight, &a), *eps);
                self.put(norm, len)
            }
            // Rows that are outputs of layers or norms.
            Expr::Pick(runs) if runs.len() > 1 && runs.iter().all(|run| self.absorbs(run, ones, zeros)) => {
                let (runs, mut at, mut moved) = (runs.clone(), 0, Vec::new());
                for run in runs {
                    let (a, b) = (a[at..at + run.len].to_vec(), b[at..at + run.len].to_vec());
                    moved.push(Run { of: self.affine(run.of, a, b), ..run });
                    at += run.len;
                }
                self.put(Expr::Pick(moved), len)
            }
            Expr::Spread(one) if uniform(&a).is_some() && uniform(&b).is_some() => {
                let one = *one;
                let one = self.affine(one, a[..1].to_vec(), b[..1].to_vec());
                self.put(Expr::Spread(one), len)
            }
            _ => self.put(Expr::Affine(x, a, b), len),
        }
    }

    /// Returns `true` if a run is a whole layer or norm that can absorb the factors and offsets. `ones` means no factors,
    /// `zeros` no offsets.
    fn absorbs(&self, run: &Run, ones: bool, zeros: bool) -> bool {
        let of_kind = match self.get(run.of) {
            Expr::Linear(..) => ones,
            Expr::LayerNorm(..) => true,
            Expr::RmsNorm(..) => zeros,
            _ => false,
        };
        of_kind && run.from == 0 && run.len == self.len_of(run.of)
    }

    /// Returns `W x + b`.
    pub(crate) fn linear(&mut self, x: Id, w: Arc<Matrix>, b: Vec<f64>) -> Id {
        let rows = w.rows;
        self.put(Expr::Linear(x, w, b), rows)
    }

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
        let expected = [0.0, GELU_TANH[0] * k, 0.0, GELU_TANH[1] * k.powi(3)];
        let is_gelu = |found: &[f64; 4]| found.iter().zip(expected).all(|(found, expected)| near(*found, expected));
        polynomials.iter().all(is_gelu).then_some(k)
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

    /// Returns `max(x, low)`.
    pub(crate) fn at_least(&mut self, x: Id, low: f64) -> Id {
        let limited = if low < -FAR_LIMIT {
            self.beyond(x, -low, 1.0)
        } else {
            let over = self.scaled(x, 1.0, -low);
            let over = self.function(Function::Relu, over);
            self.scaled(over, 1.0, low)
        };
        self.limited.insert(limited, (x, low, f64::INFINITY));
        limited
    }

    /// Returns `min(x, high)`.
    pub(crate) fn at_most(&mut self, x: Id, high: f64) -> Id {
        let limited = if high > FAR_LIMIT {
            self.beyond(x, high, -1.0)
        } else {
            let under = self.scaled(x, -1.0, high);
            let under = self.function(Function::Relu, under);
            self.scaled(under, -1.0, high)
        };
        self.limited.insert(limited, (x, f64::NEG_INFINITY, high));
        limited
    }

    /// Limits `x` to the magnitude `limit` against the direction of `sign` only: a clip, plus the part beyond it.
    fn beyond(&mut self, x: Id, limit: f64, sign: f64) -> Id {
        let len = self.len_of(x);
        let inside = self.put(Expr::Clip(x, limit), len);
        // A separate offset: one in the bias of a layer would need the layer twice.
        let over = self.put(Expr::Affine(x, vec![sign; len], vec![-limit; len]), len);
        let over = self.function(Function::Relu, over);
        let over = self.scaled(over, sign, 0.0);
        self.add(inside, over)
    }

    /// Returns the elements of `max(x, limits)`, or `min` if `sign` is -1, with a limit for each.
    pub(crate) fn limited_each(&mut self, x: Id, limits: &[f64], sign: f64) -> Vec<Element> {
        let mut all = self.elements(x);
        for far in [false, true] {
            let side = |i: usize| -sign * limits[i];
            let at = (0..limits.len()).filter(|&i| side(i) < f64::from(f32::MAX) && (side(i) > FAR_LIMIT) == far);
            let at: Vec<usize> = at.collect();
            let values: Vec<(Id, usize)> = at.iter().filter_map(|&i| value(&all[i])).collect();
            if values.is_empty() {
                continue;
            }
            let part = self.vector(&values);
            let limits: Vec<f64> = at.iter().map(|&i| limits[i]).collect();
            let part = if far { self.beyond_each(part, &limits, sign) } else { self.over_each(part, limits, sign) };
            at.into_iter().zip(self.elements(part)).for_each(|(i, element)| all[i] = element);
        }
        all
    }

    /// Limits each element by subtracting its limit and adding it again.
    fn over_each(&mut self, x: Id, limits: Vec<f64>, sign: f64) -> Id {
        let signs = vec![sign; limits.len()];
        let over = self.affine(x, signs.clone(), limits.iter().map(|limit| -sign * limit).collect());
        let over = self.function(Function::Relu, over);
        self.affine(over, signs, limits)
    }

    /// Limits each element as [`Self::beyond`] does, scaled so that all have the limit 1.
    fn beyond_each(&mut self, x: Id, limits: &[f64], sign: f64) -> Id {
        let (len, zeros) = (limits.len(), vec![0.0; limits.len()]);
        let sizes: Vec<f64> = limits.iter().map(|limit| limit.abs()).collect();
        let shares = self.affine(x, sizes.iter().map(|size| 1.0 / size).collect(), zeros.clone());
        let inside = self.put(Expr::Clip(shares, 1.0), len);
        let inside = self.affine(inside, sizes.clone(), zeros.clone());
        let over = self.put(Expr::Affine(x, vec![sign; len], sizes.iter().map(|size| -size).collect()), len);
        let over = self.function(Function::Relu, over);
        let over = self.affine(over, vec![sign; len], zeros);
        self.add(inside, over)
    }

    /// Returns the operand and both limits, one of which is infinite, of a value with a limit on one side.
    pub(crate) fn limited(&self, x: Id) -> Option<(Id, f64, f64)> {
        let relu = self.known_of(x, Function::Relu).map(|of| (of, 0.0, f64::INFINITY));
        relu.or_else(|| self.limited.get(&x).copied())
    }

    /// Limits `x` to low ..= high, either of which may be infinite.
    pub(crate) fn clip(&mut self, x: Id, low: f64, high: f64) -> Id {
        // Two successive limits, as by Max and Min.
        if let Some((inner, lowest, highest)) = self.limited(x)
            && low.max(lowest) < high.min(highest)
        {
            return self.clip(inner, low.max(lowest), high.min(highest));
        }
        if low == 0.0 && high > FAR_LIMIT {
            let (len, positive) = (self.len_of(x), self.function(Function::Relu, x));
            return if high < f64::INFINITY { self.put(Expr::Clip(positive, high), len) } else { positive };
        }
        let middle = low / 2.0 + high / 2.0;
        if middle == 0.0 || low.abs().max(high.abs()) <= MOST_CLIP {
            let len = self.len_of(x);
            let about = self.scaled(x, 1.0, -middle);
            let clipped = self.put(Expr::Clip(about, high - middle), len);
            return self.scaled(clipped, 1.0, middle);
        }
        let x = if low > f64::NEG_INFINITY { self.at_least(x, low) } else { x };
        if high < f64::INFINITY { self.at_most(x, high) } else { x }
    }

    /// Returns `max(x, y)`, as `x + relu(y - x)`.
    pub(crate) fn max(&mut self, x: Id, y: Id) -> Id {
        let negative = self.scaled(x, -1.0, 0.0);
        let more = self.add(y, negative);
        let more = self.function(Function::Relu, more);
        self.add(x, more)
    }

    /// Returns `min(x, y)`.
    pub(crate) fn min(&mut self, x: Id, y: Id) -> Id {
        let (x, y) = (self.scaled(x, -1.0, 0.0), self.scaled(y, -1.0, 0.0));
        let most = self.max(x, y);
        self.scaled(most, -1.0, 0.0)
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
