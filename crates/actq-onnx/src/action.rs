//! The action contract from the end of a network: factors, offsets and limits after the last operation.

use actq::import::contract::{Array, JsonContract};
use actq::numbers::decimal;

use crate::values::bounds::bounds;
use crate::values::expr::{Expr, Exprs, Id};

/// Largest relative difference that counts as rounding in f64.
const ROUNDING: f64 = 1e-12;

/// Scale, offset and limits of every value, as the contract applies them.
struct ContractValues {
    scale: Vec<f64>,
    offset: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Splits `root` into the value before the contract, and the contract for `act_len` values.
pub(crate) fn contract(exprs: &Exprs, root: Id, act_len: usize) -> (Id, Option<JsonContract>) {
    let n = exprs.len_of(root);
    let mut ends = ContractValues {
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
                    let (before, scale) = (ends.offset[i], ends.scale[i] * a[i]);
                    let offset = before + ends.scale[i] * b[i];
                    // A factor and its inverse, an offset and its opposite: what is left is rounding.
                    ends.scale[i] = if (scale - 1.0).abs() < ROUNDING { 1.0 } else { scale };
                    ends.offset[i] = if offset.abs() <= ROUNDING * before.abs() { 0.0 } else { offset };
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

/// Limits each action without limits to the bounds of its last operation, if any. Returns the contract and the number
/// of these actions. `at` is the value before the contract.
pub(crate) fn bounded(
    exprs: &Exprs,
    at: Id,
    contract: Option<JsonContract>,
    act_len: usize,
) -> (Option<JsonContract>, usize) {
    let mut json = contract.unwrap_or_default();
    let own = |i| [value(&json.low, i, f32::MIN), value(&json.high, i, f32::MAX)];
    let (mut limits, mut found): (Vec<[f32; 2]>, _) = ((0..act_len).map(own).collect(), 0);
    for (i, limits) in limits.iter_mut().enumerate().filter(|(_, limits)| **limits == [f32::MIN, f32::MAX]) {
        if let Some(ends) = ends(exprs, at, &json, i, act_len) {
            (*limits, found) = (ends, found + 1);
        }
    }
    if found > 0 {
        [json.low, json.high] =
            [0, 1].map(|side| Some(limits.iter().map(|limits| Some(decimal(limits[side]))).collect()));
    }
    (Some(json).filter(|json| *json != JsonContract::default()), found)
}

/// Returns the bounds of action `i` in all actions of a chunk, after the contract's factor and offset.
fn ends(exprs: &Exprs, at: Id, json: &JsonContract, i: usize, act_len: usize) -> Option<[f32; 2]> {
    let (scale, offset) = (value(&json.scale, i, 1.0), value(&json.offset, i, 0.0));
    let [mut low, mut high] = [f32::MAX, f32::MIN];
    for place in (i..exprs.len_of(at)).step_by(act_len) {
        let bounds = if scale == 0.0 { [0.0; 2] } else { bounds(exprs, at, place)? };
        // In f32, as the contract computes; rounding is monotonic.
        for end in bounds.map(|bound| bound * scale + offset) {
            (low, high) = (low.min(end), high.max(end));
        }
    }
    (low > f32::MIN && high < f32::MAX).then_some([low, high])
}

fn value(array: &Array, i: usize, none: f32) -> f32 {
    array.as_ref().and_then(|values| values[i]).map_or(none, |value| value as f32)
}

impl ContractValues {
    /// Returns the contract, if it is the same for all actions of a chunk and finite in f32.
    fn json(&self, act_len: usize) -> Option<JsonContract> {
        let each = |values: &[f64], none: f64, unlimited: f64| -> Option<Array> {
            let first = values.get(..act_len)?;
            if values.chunks(act_len).any(|action| action != first) {
                return None;
            }
            if first.iter().all(|v| *v == none) {
                return Some(None);
            }
            let one = |v: &f64| if *v == none { unlimited } else { decimal(*v as f32) };
            let values: Vec<f64> = first.iter().map(one).collect();
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
