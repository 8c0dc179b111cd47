//! Elements stripped of moves, factors and offsets. Patterns compare values by these, as exporters may write factors
//! and orders anywhere.

use crate::values::compare::near;
use crate::values::expr::{Expr, Exprs, Id, Run};

/// The most nested moves and factors that are examined.
const DEPTH: usize = 16;

/// An element that is not the result of a move, factor or offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Source {
    of: Id,
    at: usize,
    /// The norm whose operand is `of`, with its weight and bias as a factor and an offset.
    norm: Option<Norm>,
}

/// A norm, with the bits of its epsilon.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Norm {
    Layer(u64),
    Rms(u64),
}

/// `factor source + offset`; a constant has no source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub(crate) source: Option<Source>,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

impl Source {
    /// Returns the run from this element on, if it is not of a norm.
    pub(crate) fn run(self, len: usize) -> Option<Run> {
        self.norm.is_none().then_some(Run { of: self.of, from: self.at, len })
    }
}

impl Part {
    /// Returns `true` if the source of `next` follows this one's.
    pub(crate) fn is_before(&self, next: &Self) -> bool {
        self.source.map(|source| Source { at: source.at + 1, ..source }) == next.source
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.source.is_none() && self.offset == 0.0
    }

    /// Returns the k for which this is `k x`; NaN if both are 0, which any k fits.
    fn over(&self, x: &Self) -> Option<f64> {
        let k = if x.factor == 0.0 { self.offset / x.offset } else { self.factor / x.factor };
        let times = if k.is_nan() { 0.0 } else { k };
        let is_multiple = near(self.factor, times * x.factor) && near(self.offset, times * x.offset);
        (self.source == x.source && is_multiple && k != 0.0 && !k.is_infinite()).then_some(k)
    }
}

impl Exprs {
    /// Returns the parts of all elements.
    pub(crate) fn parts(&self, id: Id) -> Vec<Part> {
        self.parts_of(Run { of: id, from: 0, len: self.len_of(id) })
    }

    /// Returns the parts of the elements of a run.
    pub(crate) fn parts_of(&self, run: Run) -> Vec<Part> {
        self.parts_within(run, DEPTH)
    }

    fn parts_within(&self, run: Run, depth: usize) -> Vec<Part> {
        let places = run.from..run.from + run.len;
        let sources = |of: Id, norm: Option<Norm>| -> Vec<Part> {
            let part = |at| Part { source: Some(Source { of, at, norm }), factor: 1.0, offset: 0.0 };
            places.clone().map(part).collect()
        };
        let Some(depth) = depth.checked_sub(1) else { return sources(run.of, None) };
        match self.get(run.of) {
            Expr::Pick(runs) => cut(runs, run).into_iter().flat_map(|run| self.parts_within(run, depth)).collect(),
            Expr::Spread(one) => self.parts_within(Run { of: *one, from: 0, len: 1 }, depth).repeat(run.len),
            Expr::Affine(x, a, b) => {
                scaled(self.parts_within(Run { of: *x, ..run }, depth), &a[places.clone()], &b[places])
            }
            Expr::Linear(..) if self.is_constant(run.of) => self.biases(run),
            Expr::LayerNorm(x, weight, bias, eps) => {
                scaled(sources(*x, Some(Norm::Layer(eps.to_bits()))), &weight[places.clone()], &bias[places])
            }
            Expr::RmsNorm(x, weight, eps) => {
                let sources = sources(*x, Some(Norm::Rms(eps.to_bits())));
                scaled(sources, &weight[places], &vec![0.0; run.len])
            }
            _ => sources(run.of, None),
        }
    }

    /// Returns `true` if a layer has biases only, as constants in a vector do.
    pub(crate) fn is_constant(&self, id: Id) -> bool {
        matches!(self.get(id), Expr::Linear(_, w, _) if w.cols == 1 && w.data.iter().all(|w| *w == 0.0))
    }

    fn biases(&self, run: Run) -> Vec<Part> {
        let Expr::Linear(_, _, bias) = self.get(run.of) else { return Vec::new() };
        let constant = |&offset: &f64| Part { source: None, factor: 0.0, offset };
        bias[run.from..run.from + run.len].iter().map(constant).collect()
    }

    /// Returns the k of each element for which `y = k x`.
    pub(crate) fn ratios(&self, y: Id, x: Id) -> Option<Vec<f64>> {
        if self.len_of(y) != self.len_of(x) {
            return None;
        }
        if y == x {
            return Some(vec![1.0; self.len_of(x)]);
        }
        // For most values, the first element already decides.
        let [first_y, first_x] = [y, x].map(|of| self.parts_of(Run { of, from: 0, len: 1 }));
        first_y.first()?.over(first_x.first()?)?;
        let ratios: Vec<f64> =
            self.parts(y).iter().zip(&self.parts(x)).map(|(y, x)| y.over(x)).collect::<Option<_>>()?;
        let known = ratios.iter().copied().find(|k| !k.is_nan())?;
        Some(ratios.into_iter().map(|k| if k.is_nan() { known } else { k }).collect())
    }

    /// Returns the k for which `y = k x`.
    pub(crate) fn ratio(&self, y: Id, x: Id) -> Option<f64> {
        let ratios = self.ratios(y, x)?;
        let k = *ratios.first()?;
        ratios.iter().all(|ratio| near(*ratio, k)).then_some(k)
    }
}

/// Scales and shifts parts: `a x + b`.
fn scaled(parts: Vec<Part>, a: &[f64], b: &[f64]) -> Vec<Part> {
    let one =
        |((part, a), b): ((Part, &f64), &f64)| Part { factor: part.factor * a, offset: part.offset * a + b, ..part };
    parts.into_iter().zip(a).zip(b).map(one).collect()
}

/// Returns the parts of `runs` that hold a run of their concatenation.
pub(crate) fn cut(runs: &[Run], run: Run) -> Vec<Run> {
    let (mut skip, mut left, mut found) = (run.from, run.len, Vec::new());
    for part in runs {
        let len = part.len.saturating_sub(skip).min(left);
        if len > 0 {
            found.push(Run { of: part.of, from: part.from + skip, len });
        }
        skip = skip.saturating_sub(part.len);
        left -= len;
    }
    found
}
