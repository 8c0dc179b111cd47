//! Limits of values.

use actq_kernels::math::Function;

use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Guard, Id};
use crate::values::tensor::Element;

/// Largest limit of a clip that becomes one operation about its middle; beyond it, the offset would cost digits.
const MAX_CLIP: f64 = 100.0;
/// Largest distance of a limit from zero at which it is subtracted and added again; beyond it, small values would lose
/// digits.
const FAR_LIMIT: f64 = 1.0;

impl Exprs {
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
        if let Some(both) = self.clipped_each(x, limits, sign) {
            return self.elements(both);
        }
        let all = self.one_sided_each(x, limits, sign);
        if let Some(values) = all.iter().map(value).collect::<Option<Vec<_>>>() {
            let limited = self.vector(&values);
            self.limited_each.insert(limited, (x, limits.to_vec(), sign));
        }
        all
    }

    /// Returns `x` between limits for each element, if it has limits on the other side: a clip of shares of the ranges.
    fn clipped_each(&mut self, x: Id, limits: &[f64], sign: f64) -> Option<Id> {
        let (inner, others) = match (self.limited_each.get(&x), self.limited(x)) {
            (Some((inner, others, other)), _) if *other == -sign => (*inner, others.clone()),
            (_, Some((inner, low, high))) => (inner, vec![if sign > 0.0 { high } else { low }; limits.len()]),
            _ => return None,
        };
        let [low, high] = if sign > 0.0 { [limits, &others] } else { [&others, limits] };
        let ranges = || low.iter().zip(high);
        let fits = |(low, high): (&f64, &f64)| {
            let most = low.abs().max(high.abs());
            low < high && (most <= MAX_CLIP || -low == *high && most < f64::from(f32::MAX))
        };
        if !ranges().all(fits) {
            return None;
        }
        let half: Vec<f64> = ranges().map(|(low, high)| high / 2.0 - low / 2.0).collect();
        let middle: Vec<f64> = ranges().map(|(low, high)| high / 2.0 + low / 2.0).collect();
        let to_zero = half.iter().zip(&middle).map(|(half, middle)| -middle / half).collect();
        let shares = self.affine(inner, half.iter().map(|half| 1.0 / half).collect(), to_zero);
        let clipped = self.put(Expr::Clip(shares, 1.0), limits.len());
        Some(self.affine(clipped, half, middle))
    }

    /// Returns the elements of [`Self::limited_each`] without limits on the other side.
    fn one_sided_each(&mut self, x: Id, limits: &[f64], sign: f64) -> Vec<Element> {
        let mut all = self.elements(x);
        for far in [false, true] {
            let side = |i: usize| -sign * limits[i];
            if (0..limits.len()).any(|i| limits[i].is_finite() && side(i) >= f64::from(f32::MAX)) {
                self.guards.insert((self.node, Guard::Infinity));
            }
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
        // Exporters write f32's largest number for no limit. It limits infinity only.
        let most = f64::from(f32::MAX);
        if low.is_finite() && low <= -most || high.is_finite() && high >= most {
            self.guards.insert((self.node, Guard::Infinity));
        }
        let low = if low <= -most { f64::NEG_INFINITY } else { low };
        let high = if high >= most { f64::INFINITY } else { high };
        if low == f64::NEG_INFINITY && high == f64::INFINITY {
            return x;
        }
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
        if middle == 0.0 || low.abs().max(high.abs()) <= MAX_CLIP {
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
}
