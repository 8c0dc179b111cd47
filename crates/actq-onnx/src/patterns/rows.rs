//! Rows with one number each, such as the mean of a row. An operation on all rows and their numbers is split into rows,
//! so that norms are recognized.

use std::collections::HashMap;

use crate::patterns::parts::cut;
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Run};
use crate::values::tensor::Element;

/// The most rows, each of which takes separate operations.
const MAX_ROWS: usize = 256;
/// The most operations between sums and a number that is computed from them.
const DEPTH: usize = 16;

/// Results of previous searches for elements.
type Found = HashMap<(Id, usize), Option<Id>>;

/// Splits the places `at` into rows, if one of two operands has a number for each row; else returns one row.
pub(crate) fn by_row(exprs: &mut Exprs, at: Vec<usize>, operands: [&[Element]; 2]) -> Vec<Vec<usize>> {
    operands.into_iter().find_map(|operand| rows(exprs, &at, operand)).unwrap_or_else(|| vec![at])
}

/// Groups places by their element of `operand` up to factors, if the elements are sums or computed from sums.
fn rows(exprs: &mut Exprs, at: &[usize], operand: &[Element]) -> Option<Vec<Vec<usize>>> {
    let mut rows: Vec<((Id, usize), Vec<usize>)> = Vec::new();
    let mut row_of: HashMap<(Id, usize), usize> = HashMap::new();
    for &place in at {
        let number = exprs.number(operand[place])?;
        let row = *row_of.entry(number).or_insert(rows.len());
        match rows.get_mut(row) {
            Some((_, places)) => places.push(place),
            None if row < MAX_ROWS => rows.push((number, vec![place])),
            None => return None,
        }
    }
    let each = at.len() / rows.len().max(1);
    let are_rows = rows.len() > 1 && each > 1 && rows.iter().all(|(_, places)| places.len() == each);
    let of_sums = are_rows && rows.iter().all(|&((of, i), _)| exprs.lone(of, i).is_some());
    of_sums.then(|| rows.into_iter().map(|(_, places)| places).collect())
}

impl Exprs {
    /// Returns an element, or the repeated number from which it is scaled, which identifies the row.
    fn number(&self, element: Element) -> Option<(Id, usize)> {
        let (id, i) = value(&element)?;
        match *self.get(id) {
            Expr::Affine(x, ..) if matches!(self.get(x), Expr::Spread(_)) => Some((x, 0)),
            _ => Some((id, i)),
        }
    }

    /// Returns `true` if these elements are one number, up to factors, that is computed from sums.
    pub(crate) fn is_number_of_sums(&mut self, elements: &[Element]) -> bool {
        let Some(first) = elements.first().and_then(|element| self.number(*element)) else { return false };
        elements.iter().all(|element| self.number(*element) == Some(first)) && self.lone(first.0, first.1).is_some()
    }

    /// Returns element `i` of a value as a separate value, if it is computed from sums only.
    pub(crate) fn lone(&mut self, of: Id, i: usize) -> Option<Id> {
        self.lone_within(of, i, DEPTH, &mut Found::new())
    }

    fn lone_within(&mut self, of: Id, i: usize, depth: usize, found: &mut Found) -> Option<Id> {
        if let Some(&known) = found.get(&(of, i)) {
            return known;
        }
        let depth = depth.checked_sub(1)?;
        let mut at = |exprs: &mut Self, x: Id, i: usize| exprs.lone_within(x, i, depth, found);
        let lone = match *self.get(of) {
            Expr::Sum(_) => Some(of),
            Expr::Spread(one) => at(self, one, 0),
            Expr::Pick(ref runs) if runs.len() <= MAX_ROWS => {
                let run = *cut(runs, Run { of, from: i, len: 1 }).first()?;
                at(self, run.of, run.from)
            }
            Expr::Affine(x, ref a, ref b) => {
                let (a, b) = (a[i], b[i]);
                at(self, x, i).map(|x| self.affine(x, vec![a], vec![b]))
            }
            Expr::Unary(f, x) => at(self, x, i).map(|x| self.unary(f, x)),
            Expr::Add(x, y) => at(self, x, i).zip(at(self, y, i)).map(|(x, y)| self.add(x, y)),
            Expr::Mul(x, y) => at(self, x, i).zip(at(self, y, i)).map(|(x, y)| self.mul(x, y)),
            _ => None,
        };
        found.insert((of, i), lone);
        lone
    }
}
