//! Elements without what moves, scales and shifts them: patterns compare values by these, since an exporter may write
//! factors and orders anywhere.

use crate::values::compare::near;
use crate::values::expr::{Expr, Exprs, Id, Run};

/// Moves and factors within each other that are looked through.
const DEPTH: usize = 16;

/// An element that no move, factor or offset gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Source {
    of: Id,
    at: usize,
    /// `of` is the operand of this norm, whose weight and bias are a factor and an offset.
    norm: Option<Norm>,
}

/// A norm, with the bits of what is added to its mean square.
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
    /// This element and those after it, where they are not of a norm.
    pub(crate) fn run(self, len: usize) -> Option<Run> {
        self.norm.is_none().then_some(Run { of: self.of, from: self.at, len })
    }
}

impl Part {
    /// Whether the source of `next` is the one after this one's.
    pub(crate) fn is_before(&self, next: &Self) -> bool {
        self.source.map(|source| Source { at: source.at + 1, ..source }) == next.source
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.source.is_none() && self.offset == 0.0
    }

    /// The k for which this is `k x`: not a number where both are 0, so that any would do.
    fn over(&self, x: &Self) -> Option<f64> {
        let k = if x.factor == 0.0 { self.offset / x.offset } else { self.factor / x.factor };
        let times = if k.is_nan() { 0.0 } else { k };
        let is_multiple = near(self.factor, times * x.factor) && near(self.offset, times * x.offset);
        (self.source == x.source && is_multiple && k != 0.0 && !k.is_infinite()).then_some(k)
    }
}

impl Exprs {
    /// The parts of all elements.
    pub(crate) fn parts(&self, id: Id) -> Vec<Part> {
        self.parts_of(Run { of: id, from: 0, len: self.len_of(id) })
    }

    /// The parts of the elements of a run.
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

    /// Whether a layer has nothing but biases, as constants in a vector have.
    pub(crate) fn is_constant(&self, id: Id) -> bool {
        matches!(self.get(id), Expr::Linear(_, w, _) if w.cols == 1 && w.data.iter().all(|w| *w == 0.0))
    }

    fn biases(&self, run: Run) -> Vec<Part> {
        let Expr::Linear(_, _, bias) = self.get(run.of) else { return Vec::new() };
        let constant = |&offset: &f64| Part { source: None, factor: 0.0, offset };
        bias[run.from..run.from + run.len].iter().map(constant).collect()
    }

    /// The k of each element for which `y = k x`.
    pub(crate) fn ratios(&self, y: Id, x: Id) -> Option<Vec<f64>> {
        if self.len_of(y) != self.len_of(x) {
            return None;
        }
        if y == x {
            return Some(vec![1.0; self.len_of(x)]);
        }
        // The first elements alone show it of most values.
        let [first_y, first_x] = [y, x].map(|of| self.parts_of(Run { of, from: 0, len: 1 }));
        first_y.first()?.over(first_x.first()?)?;
        let ratios: Vec<f64> =
            self.parts(y).iter().zip(&self.parts(x)).map(|(y, x)| y.over(x)).collect::<Option<_>>()?;
        let known = ratios.iter().copied().find(|k| !k.is_nan())?;
        Some(ratios.into_iter().map(|k| if k.is_nan() { known } else { k }).collect())
    }

    /// The k for which `y = k x`.
    pub(crate) fn ratio(&self, y: Id, x: Id) -> Option<f64> {
        let ratios = self.ratios(y, x)?;
        let k = *ratios.first()?;
        ratios.iter().all(|ratio| near(*ratio, k)).then_some(k)
    }
}

/// `a x + b`
fn scaled(parts: Vec<Part>, a: &[f64], b: &[f64]) -> Vec<Part> {
    let one =
        |((part, a), b): ((Part, &f64), &f64)| Part { factor: part.factor * a, offset: part.offset * a + b, ..part };
    parts.into_iter().zip(a).zip(b).map(one).collect()
}

/// The runs that hold a run of a value that consists of `runs`.
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
