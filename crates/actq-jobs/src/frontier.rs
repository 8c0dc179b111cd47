//! Points that no other one beats, and where a curve bends.

use libm::log;

/// Returns the points that no other one beats, as indices in the order of their first value. They are all points whose
/// second value is less than that of every point with at most as much of the first. Of equal points, the first counts.
pub fn frontier(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    // The sort keeps the order of equal ones.
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut least = f64::INFINITY;
    order.retain(|&point| {
        let better = points[point].1 < least;
        least = least.min(points[point].1);
        better
    });
    order
}

/// Returns an error for a logarithmic axis. An error of 0 has no logarithm; it counts as the smallest that f32 actions
/// can show.
pub(crate) fn drawn_error(nmse: f64) -> f64 {
    nmse.max(1e-14)
}

/// Bytes and error of a curve's image at each budget; `None` without one.
pub(crate) type Curve = Vec<Option<(f64, f64)>>;

/// Finds the knee of the best curve, as the curve's index and the budget's.
///
/// The best curve has the lowest error at most budgets; among equals, it is the first. Its knee is the point furthest
/// below the chord from its first point to its last, in log error over bytes of the image. Before the knee a byte gains
/// more than on average, after it less. `None` if no point is below the chord.
pub(crate) fn knee(curves: &[Curve]) -> Option<(usize, usize)> {
    let budgets = curves.iter().map(Vec::len).max()?;
    let mut wins = vec![0; curves.len()];
    for budget in 0..budgets {
        let error = |curve: usize| Some((curve, curves[curve].get(budget)?.as_ref()?.1));
        if let Some((best, _)) = (0..curves.len()).filter_map(error).min_by(|a, b| a.1.total_cmp(&b.1)) {
            wins[best] += 1;
        }
    }
    let best = (0..curves.len()).rev().max_by_key(|&curve| wins[curve])?;
    let at = |(budget, point): (usize, &Option<(f64, f64)>)| point.map(|(x, y)| (budget, x, drawn_error(y)));
    let mut points: Vec<(usize, f64, f64)> = curves[best].iter().enumerate().filter_map(at).collect();
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (&(_, x0, y0), &(_, x1, y1)) = (points.first()?, points.last()?);
    let below = |x: f64, y: f64| log(y0) + log(y1 / y0) * (x - x0) / (x1 - x0) - log(y);
    let depths = points.iter().map(|&(budget, x, y)| (below(x, y), budget));
    let (depth, budget) = depths.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (depth > 1e-9).then_some((best, budget))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_knee_bends_the_best_curve() {
        let curve = |points: [(f64, f64); 4]| points.map(|(bits, error)| Some((1000.0 * bits, error))).to_vec();
        let worse = curve([(2.0, 0.9), (2.5, 0.8), (3.0, 0.5), (4.0, 1e-4)]);
        let better = curve([(2.0, 0.5), (2.5, 0.01), (3.0, 0.006), (4.0, 0.003)]);
        assert_eq!(knee(&[worse.clone(), better]), Some((1, 1)));
        assert!(knee(&[worse]).is_none(), "a curve above its chord has no knee");
        assert!(knee(&[]).is_none());
        assert!(knee(&[vec![Some((3.0, 0.1)), None]]).is_none());
    }

    #[test]
    fn no_other_point_beats_the_frontier() {
        let points = [(3.0, 0.2), (1.0, 0.9), (2.0, 0.9), (3.0, 0.1), (4.0, 0.3), (5.0, 0.01), (1.0, 0.9)];
        assert_eq!(frontier(&points), [1, 3, 5]);
        assert!(frontier(&[]).is_empty());
    }
}
