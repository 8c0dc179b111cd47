//! The rates that fit the samples best.

use std::collections::BTreeMap;

use actq_kernels::cost::{Cost, CostItem};

use super::sample::{Rates, Sample};

/// Computes the non-negative rates with the least sum of squared relative errors (Lawson and Hanson, Solving Least
/// Squares Problems, 1974, chapter 23, on the normal equations).
pub(super) fn solve(samples: &[&Sample], of: impl Fn(Cost) -> u64) -> Rates {
    let mut items: Vec<CostItem> = samples.iter().flat_map(|s| s.items.keys().copied()).collect();
    items.sort();
    items.dedup();
    let place: BTreeMap<CostItem, usize> = items.iter().enumerate().map(|(i, f)| (*f, i)).collect();
    let n = items.len();
    let (mut normal, mut right) = (vec![vec![0.0f64; n]; n], vec![0.0f64; n]);
    for sample in samples {
        let target = of(sample.cost) as f64;
        // Relative errors; short samples may be off by a few instructions.
        let weight = 1.0 / (target + 100.0);
        let row: Vec<(usize, f64)> = sample.items.iter().map(|(f, count)| (place[f], count * weight)).collect();
        for &(i, a) in &row {
            row.iter().for_each(|&(j, b)| normal[i][j] += a * b);
            right[i] += a * target * weight;
        }
    }
    // Scale the items alike, so that one threshold for small values holds for all.
    let scale: Vec<f64> = (0..n).map(|i| normal[i][i].sqrt()).collect();
    for i in 0..n {
        right[i] /= scale[i];
        (0..n).for_each(|j| normal[i][j] /= scale[i] * scale[j]);
    }
    let mut rates = vec![0.0f64; n];
    let mut used: Vec<usize> = Vec::new();
    loop {
        let gain = |i: usize| right[i] - (0..n).map(|j| normal[i][j] * rates[j]).sum::<f64>();
        let unused = (0..n).filter(|i| !used.contains(i));
        let Some((gain, next)) = unused.map(|i| (gain(i), i)).max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if gain < 1e-7 {
            break;
        }
        used.push(next);
        loop {
            let wanted = least_squares(&normal, &right, &used);
            // Go towards the solution until a rate would become negative; exclude the rates that would.
            let share = |(&i, &x): (&usize, &f64)| if x > 0.0 { 1.0 } else { rates[i] / (rates[i] - x) };
            let step = used.iter().zip(&wanted).map(share).fold(1.0, f64::min);
            used.iter().zip(&wanted).for_each(|(&i, x)| rates[i] += step * (x - rates[i]));
            if step >= 1.0 {
                break;
            }
            used.retain(|&i| rates[i] > 1e-12);
            rates.iter_mut().enumerate().filter(|(i, _)| !used.contains(i)).for_each(|(_, rate)| *rate = 0.0);
        }
    }
    (0..n).map(|i| (items[i], rates[i] / scale[i])).collect()
}

/// Solves the normal equations for some of the items by elimination.
fn least_squares(normal: &[Vec<f64>], right: &[f64], used: &[usize]) -> Vec<f64> {
    let mut rows: Vec<Vec<f64>> =
        used.iter().map(|&i| used.iter().map(|&j| normal[i][j]).chain([right[i]]).collect()).collect();
    for pivot in 0..rows.len() {
        let row = rows[pivot].clone();
        // An item that others determine gets 0.
        let small = row[pivot] < 1e-9;
        for (i, other) in rows.iter_mut().enumerate() {
            match (i == pivot, small) {
                (true, true) => other.fill(0.0),
                (false, true) => other[pivot] = 0.0,
                (true, false) => {}
                (false, false) => {
                    let factor = other[pivot] / row[pivot];
                    other.iter_mut().zip(&row).skip(pivot).for_each(|(o, r)| *o -= factor * r);
                }
            }
        }
    }
    (0..rows.len()).map(|i| if rows[i][i] == 0.0 { 0.0 } else { rows[i][rows.len()] / rows[i][i] }).collect()
}
