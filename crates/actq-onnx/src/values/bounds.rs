//! Bounds of a value from the last operations before it.

use actq_kernels::math::Function;

use crate::values::expr::{Expr, Exprs, Id, Run, Unary};

/// The most operations that are examined; exporters write fewer.
const DEPTH: usize = 16;

/// Upper bound of the relative rounding error in f32 of a factor and an offset: the operation rounds its two constants,
/// a difference, a product and these bounds.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// Returns the bounds of an element in f32 arithmetic, the lower one first; `None` if no operation bounds it.
pub(crate) fn bounds(exprs: &Exprs, id: Id, i: usize) -> Option<[f32; 2]> {
    within(exprs, id, i, DEPTH)
}

fn within(exprs: &Exprs, id: Id, i: usize, depth: usize) -> Option<[f32; 2]> {
    let depth = depth.checked_sub(1)?;
    match exprs.get(id) {
        Expr::Unary(Unary::Known(Function::Tanh), _) => Some([-1.0, 1.0]),
        Expr::Unary(Unary::Known(Function::Sigmoid), _) => Some([0.0, 1.0]),
        Expr::Clip(_, limit) => Some([-limit as f32, *limit as f32]),
        Expr::Spread(x) => within(exprs, *x, 0, depth),
        Expr::Pick(runs) => {
            let (of, at) = place(runs, i)?;
            within(exprs, of, at, depth)
        }
        Expr::Affine(x, a, b) => Some(affine(a[i], b[i], within(exprs, *x, i, depth)?)),
        _ => None,
    }
}

/// Finds the `i`-th element of runs.
fn place(runs: &[Run], mut i: usize) -> Option<(Id, usize)> {
    for run in runs {
        if i < run.len {
            return Some((run.of, run.from + i));
        }
        i -= run.len;
    }
    None
}

/// Returns the bounds of `a x + b` from those of x.
fn affine(a: f64, b: f64, ends: [f32; 2]) -> [f32; 2] {
    let [one, two] = ends.map(|end| a * f64::from(end));
    let rounding = ROUNDING * (one.abs().max(two.abs()) + b.abs());
    [(one.min(two) + b - rounding) as f32, (one.max(two) + b + rounding) as f32]
}
