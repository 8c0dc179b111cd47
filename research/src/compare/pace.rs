//! Estimate of the remaining time.

use super::cell::{Cell, CellKey};

/// Estimates the seconds of `missing` cells from the finished ones: the time of the same method on the same policy, or
/// else on any policy, or else the mean of all. Making and driving run at the same time. Returns `None` while nothing
/// is finished.
pub(super) fn seconds_left(done: &[Cell], missing: &[CellKey]) -> Option<f64> {
    let mean = |part: &dyn Fn(&Cell) -> Option<f64>, is_like: &dyn Fn(&CellKey) -> bool| -> Option<f64> {
        let values: Vec<f64> = done.iter().filter(|cell| is_like(&cell.key)).filter_map(part).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let expected = |part: &dyn Fn(&Cell) -> Option<f64>, key: &CellKey| {
        mean(part, &|k| k.policy == key.policy && k.method == key.method)
            .or_else(|| mean(part, &|k| k.method == key.method))
            .or_else(|| mean(part, &|_| true))
    };
    let making = |cell: &Cell| Some(cell.made.as_ref().map_or(0.0, |made| made.seconds));
    let driving = |cell: &Cell| cell.driven.as_ref().map(|_| cell.drive_seconds);
    let made: f64 = missing.iter().filter_map(|key| expected(&making, key)).sum();
    // The time to drive depends on the policy, not on the method.
    let drives = |key: &CellKey| mean(&driving, &|k| k.policy == key.policy).or_else(|| mean(&driving, &|_| true));
    let driven: f64 = missing.iter().filter_map(drives).sum();
    // An empty sum is -0.
    (!done.is_empty()).then(|| made.max(driven) + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::plan::Contender;

    #[test]
    fn remaining_time_follows_from_similar_cells() {
        let key = |policy: &str, method| CellKey { policy: policy.into(), method: Some(method), budget: Some(2.0) };
        let cell =
            |key: CellKey, seconds| Cell { key, made: None, why: None, driven: Some(1.into()), drive_seconds: seconds };
        assert!(seconds_left(&[], &[key("a", Contender::Rtn)]).is_none());
        let done = [cell(key("a", Contender::Rtn), 10.0), cell(key("b", Contender::Rtn), 30.0)];
        let left = |missing: &[CellKey]| seconds_left(&done, missing).expect("something is done");
        assert_eq!(left(&[key("b", Contender::Distill)]), 30.0);
        assert_eq!(left(&[key("c", Contender::Distill), key("a", Contender::Gptq)]), 30.0);
        assert_eq!(left(&[]), 0.0);
    }
}
