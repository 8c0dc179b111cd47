//! Recognition of attention's scores, with their factor and mask.

use std::sync::Arc;

use actq::error::{Result, bail, ensure};

use crate::patterns::parts::Part;
use crate::values::compare::near;
use crate::values::elements::{open_vector, value};
use crate::values::expr::{Expr, Exprs, Id, Matrix, Products, Run, Unary};
use crate::values::tensor::Element;

/// The largest number beside 0 that masks a score; BERT's files have it.
pub(crate) const MASKED: f64 = -1e4;

/// Scores of a softmax.
pub(crate) struct Scores {
    /// The products of queries and keys.
    pub(crate) products: Id,
    pub(crate) factor: f64,
    /// `true` if a query sees no later key than its own, `false` if it sees all.
    pub(crate) causal: bool,
    /// As [`crate::values::expr::Attention::valid`].
    pub(crate) valid: Vec<Option<(Id, usize)>>,
}

/// A score before the softmax.
#[derive(Clone, Copy)]
struct Score {
    /// Product that it comes from.
    of: Id,
    at: usize,
    factor: f64,
    offset: f64,
    /// Element that is 0 for a masked score, else 1.
    valid: Option<(Id, usize)>,
}

/// Layers over keys, whose rows are constant queries.
struct Layers {
    /// Operand and matrix for every key of every head.
    of_keys: Vec<(Id, Arc<Matrix>)>,
    /// Rows of each.
    rows: usize,
}

impl Exprs {
    /// Finds the scores that are the elements of a softmax over rows of `cols`; `None` if they are no products of two
    /// values.
    ///
    /// # Errors
    ///
    /// If their mask is not supported.
    pub(crate) fn scores(&mut self, elements: &[Element], cols: usize) -> Result<Option<Scores>> {
        let elements = match self.of_layers(elements, cols)? {
            Some(products) => products,
            None => elements.to_vec(),
        };
        let mut scores: Vec<Option<Score>> = Vec::with_capacity(elements.len());
        for element in &elements {
            scores.push(match value(element) {
                None => None,
                Some((id, i)) => match self.score(id, i) {
                    Some(score) => Some(score),
                    None => return Ok(None),
                },
            });
        }
        let Some(first) = scores.iter().flatten().next().copied() else { return Ok(None) };
        let &Expr::Products(Products { batch, rows, cols: keys, .. }) = self.get(first.of) else { return Ok(None) };
        let in_order = |(i, score): (usize, &Option<Score>)| score.is_none_or(|s| s.of == first.of && s.at == i);
        if keys != cols || scores.len() != batch * rows * keys || !scores.iter().enumerate().all(in_order) {
            return Ok(None);
        }
        ensure!(
            scores.iter().flatten().all(|score| near(score.factor, first.factor)) && first.factor != 0.0,
            "has scores with different factors, and attention has one"
        );
        let mut valid = Vec::new();
        let mut seen = Vec::with_capacity(elements.len());
        for (row, elements) in scores.chunks(cols).zip(elements.chunks(cols)) {
            let of_row = seen_of(row, elements)?;
            let valid_of_row: Vec<_> = row.iter().map(|score| score.and_then(|score| score.valid)).collect();
            if seen.is_empty() {
                valid = valid_of_row;
            } else {
                ensure!(valid == valid_of_row, "has a mask that differs between heads or queries; it must be the same");
            }
            seen.extend(of_row);
        }
        if valid.iter().all(Option::is_none) {
            valid.clear();
        }
        let causal = match seen.iter().all(|seen| *seen) {
            true => false,
            false => {
                let last = |i: usize| i % cols + rows <= cols + i / cols % rows;
                ensure!(
                    (0..seen.len()).all(|i| seen[i] == last(i)),
                    "has a mask that is neither causal nor full: attention sees all tokens, or none after its own"
                );
                true
            }
        };
        Ok(Some(Scores { products: first.of, factor: first.factor, causal, valid }))
    }

    /// Returns the product that an element is, with factor, offset and validity.
    fn score(&self, id: Id, i: usize) -> Option<Score> {
        let part = *self.parts_of(Run { of: id, from: i, len: 1 }).first()?;
        let run = part.source?.run(1)?;
        let scaled = |score: Score| Score {
            factor: part.factor * score.factor,
            offset: part.factor * score.offset + part.offset,
            ..score
        };
        match *self.get(run.of) {
            Expr::Products(_) => {
                Some(scaled(Score { of: run.of, at: run.from, factor: 1.0, offset: 0.0, valid: None }))
            }
            Expr::Add(x, y) => {
                let of = |x: Id, y: Id| {
                    let score = self.score(x, run.from).filter(|score| score.valid.is_none())?;
                    let (valid, offset) = self.validity(y, run.from)?;
                    Some(scaled(Score { offset: score.offset + offset, valid: Some(valid), ..score }))
                };
                of(x, y).or_else(|| of(y, x))
            }
            _ => None,
        }
    }

    /// Returns the element of a graph input that an additive mask depends on, and the mask at 1. At 0 it masks.
    fn validity(&self, mask: Id, i: usize) -> Option<((Id, usize), f64)> {
        let part = *self.parts_of(Run { of: mask, from: i, len: 1 }).first()?;
        let run = part.source?.run(1)?;
        let source = match *self.get(run.of) {
            Expr::Input(_) => (run.of, run.from),
            Expr::Unary(Unary::Above(limit), x) if (0.0..1.0).contains(&limit) => {
                let inner = *self.parts_of(Run { of: x, from: run.from, len: 1 }).first()?;
                let of = inner.source?.run(1)?;
                let is_input = matches!(self.get(of.of), Expr::Input(_)) && inner.factor == 1.0 && inner.offset == 0.0;
                is_input.then_some((of.of, of.from))?
            }
            _ => return None,
        };
        let at_one = part.factor + part.offset;
        (part.offset <= at_one + MASKED).then_some((source, at_one))
    }

    /// Returns a value without a factor that all its elements have.
    pub(crate) fn without_factor(&mut self, id: Id) -> Option<(Id, f64)> {
        let parts = self.parts(id);
        let k = parts.first()?.factor;
        let of = |part: &Part| {
            let run = part.source?.run(1)?;
            (near(part.factor, k) && part.offset == 0.0).then_some((run.of, run.from))
        };
        let sources = parts.iter().map(of).collect::<Option<Vec<_>>>()?;
        (k != 0.0 && k != 1.0).then(|| (self.vector(&sources), k))
    }

    /// Turns products of constant queries, which are layers over the keys, back to products of two values.
    fn of_layers(&mut self, elements: &[Element], cols: usize) -> Result<Option<Vec<Element>>> {
        let Some(Layers { of_keys: layers, rows }) = self.layers(elements, cols) else { return Ok(None) };
        let (batch, inner) = (layers.len() / cols, layers[0].1.cols);
        let mut keys = Vec::with_capacity(layers.len() * inner);
        let mut queries = Vec::with_capacity(batch * rows * inner);
        for head in layers.chunks(cols) {
            keys.extend(head.iter().flat_map(|(x, _)| self.elements(*x)));
            queries.extend(head[0].1.data.iter().map(|v| Element::Known(*v)));
        }
        let Some(&any) = keys.iter().find(|key| value(key).is_some()) else { return Ok(None) };
        // A constant takes a value that it does not depend on.
        let with_any: Vec<Element> = queries.into_iter().chain([any]).collect();
        let a = open_vector(self, &with_any)?;
        let all = self.elements(a);
        let of_queries: Vec<(Id, usize)> = all[..all.len() - 1].iter().filter_map(value).collect();
        let (a, b) = (self.vector(&of_queries), open_vector(self, &keys)?);
        let products = self.put(Expr::Products(Products { a, b, batch, rows, inner, cols }), batch * rows * cols);
        let mut turned = elements.to_vec();
        for (i, element) in turned.iter_mut().enumerate().filter(|(_, element)| value(element).is_some()) {
            let Some((factor, offset)) = value(element).and_then(|(id, at)| self.over_layer(id, at)) else {
                return Ok(None);
            };
            let one = self.vector(&[(products, i)]);
            let one = self.affine(one, vec![factor], vec![offset]);
            *element = Element::Of(one, 0);
        }
        Ok(Some(turned))
    }

    /// Returns the layer of every key of every head, and the queries, if all elements are rows of such layers.
    fn layers(&self, elements: &[Element], cols: usize) -> Option<Layers> {
        let layer = |element: &Element| {
            let (id, i) = value(element)?;
            let run = self.parts_of(Run { of: id, from: i, len: 1 }).first()?.source?.run(1)?;
            let Expr::Linear(x, w, bias) = self.get(run.of) else { return None };
            (bias.iter().all(|b| *b == 0.0)).then(|| (run.of, run.from, *x, Arc::clone(w)))
        };
        let (_, 0, _, first) = layer(elements.iter().find(|e| value(e).is_some())?)? else { return None };
        let rows = first.rows;
        if cols == 0 || !elements.len().is_multiple_of(rows * cols) {
            return None;
        }
        let mut layers = Vec::new();
        for head in elements.chunks(rows * cols) {
            for key in 0..cols {
                let mut of_key = None;
                for query in 0..rows {
                    let element = &head[query * cols + key];
                    if value(element).is_none() {
                        continue;
                    }
                    let (id, row, x, w) = layer(element)?;
                    let known = of_key.get_or_insert((id, x, w));
                    if known.0 != id || row != query || known.2.rows != rows {
                        return None;
                    }
                }
                let (_, x, w) = of_key?;
                layers.push((x, w));
            }
        }
        let of_one_head = |head: &[(Id, Arc<Matrix>)]| head.iter().all(|(_, w)| w.data == head[0].1.data);
        (layers.chunks(cols).all(of_one_head) && layers.iter().all(|(_, w)| w.cols == first.cols))
            .then_some(Layers { of_keys: layers, rows })
    }

    /// Returns the factor and the offset of an element over the row of a layer.
    fn over_layer(&self, id: Id, i: usize) -> Option<(f64, f64)> {
        let part = *self.parts_of(Run { of: id, from: i, len: 1 }).first()?;
        Some((part.factor, part.offset))
    }
}

/// Returns which scores of a row are seen: those that no offset masks.
fn seen_of(row: &[Option<Score>], elements: &[Element]) -> Result<Vec<bool>> {
    let most = row.iter().flatten().map(|score| score.offset).fold(f64::NEG_INFINITY, f64::max);
    ensure!(most > f64::NEG_INFINITY, "masks all tokens of a query");
    let one = |(score, element): (&Option<Score>, &Element)| {
        let offset = match (score, element) {
            (Some(score), _) => score.offset,
            (None, Element::Known(number)) => *number,
            (None, Element::Of(..)) => bail!("has a score without a product; internal error; please report it"),
        };
        ensure!(
            offset <= most + MASKED || near(offset, most) || (offset - most).abs() < 1e-9,
            "adds {offset} to a score and {most} to another; a mask adds 0, or {MASKED} and less, to all of a query"
        );
        Ok(offset > most + MASKED)
    };
    row.iter().zip(elements).map(one).collect()
}
