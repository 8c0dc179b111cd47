//! The end of a network as an action contract: factors, offsets and limits behind the last operation.

use super::super::contract::{Array, JsonContract};
use super::expr::{Expr, Exprs, Id};

/// Scale, offset and limits of every value, as the contract applies them.
struct Ends {
    scale: Vec<f64>,
    offset: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

/// The value before what the contract of `act_len` values does, and the contract.
pub(super) fn contract(exprs: &Exprs, root: Id, act_len: usize) -> (Id, Option<JsonContract>) {
    let n = exprs.len_of(root);
    let mut ends = Ends {
        scale: vec![1.0; n],
        offset: vec![0.0; n],
        low: vec![f64::NEG_INFINITY; n],
        high: vec![f64::INFINITY; n],
    };
    let (mut at, mut found) = (root, (root, None));
    loop {
        at = match exprs.get(at) {
            Expr::Affine(x, a, b) => {
                for i in 0..n {
                    ends.offset[i] += ends.scale[i] * b[i];
                    ends.scale[i] *= a[i];
                }
                *x
            }
            Expr::Clip(x, limit) => {
                for i in 0..n {
                    let (one, two) = (ends.offset[i] - ends.scale[i] * limit, ends.offset[i] + ends.scale[i] * limit);
                    let (low, high) = (ends.low[i], ends.high[i]);
                    ends.low[i] = one.min(two).clamp(low, high);
                    ends.high[i] = one.max(two).clamp(low, high);
                }
                *x
            }
            _ => return found,
        };
        if !exprs.is_observed(at)
            && let Some(json) = ends.json(act_len)
        {
            found = (at, Some(json));
        }
    }
}

impl Ends {
    /// The contract, where all actions of a chunk have the same and f32 holds it.
    fn json(&self, act_len: usize) -> Option<JsonContract> {
        let each = |values: &[f64], none: f64, unlimited: f64| -> Option<Array> {
            let first = values.get(..act_len)?;
            if values.chunks(act_len).any(|action| action != first) {
                return None;
            }
            if first.iter().all(|v| *v == none) {
                return Some(None);
            }
            // The shortest text that is this f32.
            let one =
                |v: &f64| if *v == none { Some(unlimited) } else { format!("{:?}", *v as f32).parse::<f64>().ok() };
            let values: Vec<f64> = first.iter().map(one).collect::<Option<_>>()?;
            values.iter().all(|v| (*v as f32).is_finite()).then(|| Some(values.into_iter().map(Some).collect()))
        };
        let most = f64::from(f32::MAX);
        Some(JsonContract {
            scale: each(&self.scale, 1.0, 1.0)?,
            offset: each(&self.offset, 0.0, 0.0)?,
            low: each(&self.low, f64::NEG_INFINITY, -most)?,
            high: each(&self.high, f64::INFINITY, most)?,
            ..JsonContract::default()
        })
    }
}
