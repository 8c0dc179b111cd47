//! Sums of adjacent runs as sums of slices, as in a mean over time.

use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Run};

/// The most elements of a row that becomes a sum of slices.
const MAX_SLICES: usize = 64;

/// Converts sums of adjacent runs to a sum of slices, if that takes fewer operations. `new` maps expressions to their
/// replacements.
pub(crate) fn sums_of_slices(exprs: &mut Exprs, runs: &[Run], new: &dyn Fn(&Id) -> Id) -> Vec<Run> {
    let mut done = Vec::new();
    let mut rest = runs;
    while let [run, ..] = rest {
        let mut rows = Vec::new();
        while let Some(row) = rest.get(rows.len()).and_then(|run| row_of_sum(exprs, run.of))
            && rows.last().is_none_or(|last| follows(last, &row))
        {
            rows.push(row);
        }
        let n = rows.len();
        let Some(each) = rows.first().map(|row| row.elements.len()).filter(|&each| n > 1 && each <= n) else {
            done.push(*run);
            rest = &rest[1..];
            continue;
        };
        let slice = |k: usize| rows.iter().map(|row| (new(&row.elements[k].0), row.elements[k].1)).collect::<Vec<_>>();
        let mut sum = exprs.vector(&slice(0));
        for k in 1..each {
            let next = exprs.vector(&slice(k));
            sum = exprs.add(sum, next);
        }
        let (a, b) = rows.iter().map(|row| (row.factor, row.offset)).unzip();
        done.push(Run { of: exprs.affine(sum, a, b), from: 0, len: n });
        rest = &rest[n..];
    }
    done
}

/// The elements of a sum, and the factor and offset of the result.
struct RowOfSum {
    elements: Vec<(Id, usize)>,
    factor: f64,
    offset: f64,
}

fn row_of_sum(exprs: &Exprs, id: Id) -> Option<RowOfSum> {
    let (sum, factor, offset) = exprs.affine_of(id);
    let &Expr::Sum(row) = exprs.get(sum) else { return None };
    if exprs.len_of(row) > MAX_SLICES {
        return None;
    }
    let elements = exprs.elements(row).iter().map(value).collect::<Option<_>>()?;
    Some(RowOfSum { elements, factor, offset })
}

/// Returns `true` if every element of `next` follows that of `last`.
fn follows(last: &RowOfSum, next: &RowOfSum) -> bool {
    let is_next = |(a, b): (&(Id, usize), &(Id, usize))| (a.0, a.1 + 1) == *b;
    last.elements.len() == next.elements.len() && last.elements.iter().zip(&next.elements).all(is_next)
}
