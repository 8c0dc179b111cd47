//! Vectors of elements of other expressions.

use crate::patterns::parts::Part;
use crate::values::expr::{Expr, Exprs, Id, Run};
use crate::values::tensor::Element;

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
}
