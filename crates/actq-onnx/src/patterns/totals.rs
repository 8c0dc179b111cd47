//! Numbers as sums of products, independent of the file's order and factors.

use std::collections::BTreeMap;

use crate::patterns::parts::{Part, Source};
use crate::values::compare::near;
use crate::values::expr::{Expr, Exprs, Id, Run};

/// The most nested sums that are examined.
const DEPTH: usize = 10;
/// Share of an offset below which a rest is a rounding error.
const ROUNDING: f64 = 1e-12;

/// A source, or a product of two.
type Product = (Source, Option<Source>);

/// A sum of products with factors, and an offset.
#[derive(Clone, Debug, Default)]
pub(crate) struct Total {
    terms: BTreeMap<Product, f64>,
    offset: f64,
}

impl Total {
    fn add_term(&mut self, product: Product, factor: f64) {
        if factor != 0.0 {
            *self.terms.entry(product).or_default() += factor;
        }
    }

    fn add(&mut self, part: Part, factor: f64) {
        self.offset += factor * part.offset;
        if let Some(source) = part.source {
            self.add_term((source, None), factor * part.factor);
        }
    }

    fn add_product(&mut self, p: Part, q: Part, factor: f64) {
        self.add(Part { offset: 0.0, ..p }, factor * q.offset);
        self.add(q, factor * p.offset);
        if let (Some(x), Some(y)) = (p.source, q.source) {
            self.add_term((x.min(y), Some(x.max(y))), factor * p.factor * q.factor);
        }
    }

    /// Returns the k and the rest for which this is `k x + rest`.
    pub(crate) fn over(&self, x: &Self) -> Option<(f64, f64)> {
        let (product, factor) = x.terms.first_key_value()?;
        let k = self.terms.get(product)? / factor;
        let same = |((p, a), (q, b)): ((&Product, &f64), (&Product, &f64))| p == q && near(*a, k * b);
        let is_multiple = self.terms.len() == x.terms.len() && self.terms.iter().zip(&x.terms).all(same);
        let rest = self.offset - k * x.offset;
        let rest = if rest.abs() <= ROUNDING * self.offset.abs() { 0.0 } else { rest };
        (is_multiple && k.is_finite()).then_some((k, rest))
    }

    /// Removes the square of a sum of elements. Returns the sum and the factor of its square.
    pub(crate) fn take_square_of_sum(&mut self, exprs: &Exprs) -> Option<(Id, f64)> {
        let sum_of = |source: Source| source.run(1).filter(|run| matches!(exprs.get(run.of), Expr::Sum(_)));
        let square = |&(x, y): &Product| sum_of(x).filter(|_| y == Some(x)).map(|run| ((x, y), run.of));
        let (product, sum) = self.terms.keys().find_map(square)?;
        Some((sum, self.terms.remove(&product)?))
    }
}

impl Exprs {
    /// Returns the total of a value of one element.
    pub(crate) fn total(&self, id: Id) -> Total {
        self.total_of(Run { of: id, from: 0, len: 1 })
    }

    pub(crate) fn sum_of_elements(&self, id: Id) -> Total {
        self.total_of(Run { of: id, from: 0, len: self.len_of(id) })
    }

    /// Returns the sum of the squares of all elements.
    pub(crate) fn sum_of_squares(&self, id: Id) -> Total {
        let mut total = Total::default();
        self.parts(id).into_iter().for_each(|part| total.add_product(part, part, 1.0));
        total
    }

    fn total_of(&self, run: Run) -> Total {
        let mut total = Total::default();
        self.add_up(&self.parts_of(run), 1.0, &mut total, DEPTH);
        total
    }

    /// Adds parts, each times a factor, to a total.
    fn add_up(&self, parts: &[Part], factor: f64, total: &mut Total, depth: usize) {
        for run in parts.chunk_by(Part::is_before) {
            match run[0].source.and_then(|source| source.run(run.len())) {
                Some(sources) if depth > 0 => self.add_run(run, sources, factor, total, depth - 1),
                _ => run.iter().for_each(|part| total.add(*part, factor)),
            }
        }
    }

    fn add_run(&self, parts: &[Part], sources: Run, factor: f64, total: &mut Total, depth: usize) {
        let summands = match *self.get(sources.of) {
            Expr::Sum(x) => vec![self.parts(x)],
            Expr::Add(x, y) if sources.len == 1 => [x, y].map(|of| self.parts_of(Run { of, ..sources })).to_vec(),
            Expr::Mul(x, y) => {
                let [x, y] = [x, y].map(|of| self.parts_of(Run { of, ..sources }));
                for ((part, x), y) in parts.iter().zip(x).zip(y) {
                    total.offset += factor * part.offset;
                    total.add_product(x, y, factor * part.factor);
                }
                return;
            }
            _ => return parts.iter().for_each(|part| total.add(*part, factor)),
        };
        total.offset += factor * parts[0].offset;
        summands.iter().for_each(|summand| self.add_up(summand, factor * parts[0].factor, total, depth));
    }
}
