//! Scales and mins by weighted least squares.

/// Candidates for the clipping point, from [`NARROWEST`] to [`WIDEST`] times the scale that just reaches the outermost
/// weight.
const CANDIDATES: usize = 32;
const NARROWEST: f64 = 0.5;
const WIDEST: f64 = 1.1;

/// One weight in a fit of `weight = d a - d_min b`.
pub(super) struct Term {
    pub(super) importance: f64,
    pub(super) weight: f64,
    pub(super) a: f64,
    pub(super) b: f64,
}

/// Computes the d and d_min of least weighted squared error, within the terms' limits: without b, or if a negative
/// d_min would be best, d_min is 0.
pub(super) fn least_squares(terms: impl Iterator<Item = Term>) -> (f64, f64) {
    let (mut aa, mut ab, mut bb, mut wa, mut wb) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for Term { importance, weight, a, b } in terms {
        aa += importance * a * a;
        ab += importance * a * b;
        bb += importance * b * b;
        wa += importance * weight * a;
        wb += importance * weight * b;
    }
    let determinant = aa * bb - ab * ab;
    if determinant > 1e-12 * aa * bb {
        let (d, d_min) = ((wa * bb - wb * ab) / determinant, (wa * ab - wb * aa) / determinant);
        if d_min >= 0.0 {
            return (d, d_min);
        }
    }
    (if aa > 0.0 { wa / aa } else { 0.0 }, 0.0)
}

/// Returns the weighted squared error of `rounded` weights.
pub(super) fn error(weights: &[f32], rounded: &[f32], importance: &[f64]) -> f64 {
    let errors = rounded.iter().zip(weights).map(|(q, w)| f64::from(q - w).powi(2));
    errors.zip(importance).map(|(error, h)| error * h).sum()
}

/// Returns the codes nearest to the weights for `weight = s code - m`, and their weighted squared error.
pub(super) fn codes(
    weights: &[f32],
    importance: &[f64],
    (s, m): (f64, f64),
    (low, high): (i32, i32),
) -> (Vec<i32>, f64) {
    let mut error = 0.0;
    let code = |(w, h): (&f32, &f64)| {
        let w = f64::from(*w);
        let code = if s == 0.0 { 0 } else { ((w + m) / s).round().clamp(f64::from(low), f64::from(high)) as i32 };
        error += h * (s * f64::from(code) - m - w).powi(2);
        code
    };
    let codes = weights.iter().zip(importance).map(code).collect();
    (codes, error)
}

/// Returns the candidate whose codes, with the best scale and min for them, have the least error.
fn best_candidate(
    weights: &[f32],
    importance: &[f64],
    limits: (i32, i32),
    min: f64,
    candidates: impl Iterator<Item = (f64, f64)>,
) -> (f64, f64) {
    let mut best = (f64::INFINITY, (0.0, 0.0));
    for candidate in candidates {
        let (found, _) = codes(weights, importance, candidate, limits);
        let terms = found.iter().zip(weights).zip(importance);
        let terms = terms.map(|((q, w), h)| Term { importance: *h, weight: f64::from(*w), a: f64::from(*q), b: min });
        let fitted = least_squares(terms);
        let (_, error) = codes(weights, importance, fitted, limits);
        if error < best.0 {
            best = (error, fitted);
        }
    }
    best.1
}

fn factors() -> impl Iterator<Item = f64> + Clone {
    (0..=CANDIDATES).map(|step| NARROWEST + (WIDEST - NARROWEST) * step as f64 / CANDIDATES as f64)
}

/// Fits the scale, of either sign, of codes from `low` below zero to `high`.
pub(super) fn linear(weights: &[f32], importance: &[f64], limits: (i32, i32)) -> f64 {
    let largest = weights.iter().fold(0.0, |m: f64, w| m.max(f64::from(w.abs())));
    if largest == 0.0 {
        return 0.0;
    }
    // There is one more code below zero: the outermost weight may have either sign.
    let widest = largest / f64::from(limits.0);
    let candidates = factors().flat_map(|factor| [factor * widest, -factor * widest]).map(|s| (s, 0.0));
    best_candidate(weights, importance, limits, 0.0, candidates).0
}

/// Fits the scale and min, both at least 0, of codes from 0 to `high`.
pub(super) fn affine(weights: &[f32], importance: &[f64], high: i32) -> (f64, f64) {
    let (low, top) =
        weights.iter().fold((0.0, 0.0), |(low, top): (f64, f64), w| (low.min(f64::from(*w)), top.max(f64::from(*w))));
    if top == low {
        return (0.0, 0.0);
    }
    let widest = (top - low) / f64::from(high);
    // The range shrinks towards its middle, its lower end, and its upper end; the fit moves it from there.
    let candidates = factors().flat_map(|factor| {
        let cut = (1.0 - factor) * (top - low);
        [0.0, 0.5, 1.0].map(|share| (factor * widest, (-low - share * cut).max(0.0)))
    });
    let (s, m) = best_candidate(weights, importance, (0, high), 1.0, candidates);
    // If the min alone represents all weights best, for example when they are equal.
    (s.max(0.0), m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exactly_representable_weights_are_found() {
        let h = [1.0; 16];
        for codes in [[0, 1, 2, 3], [3, 0, 0, 1]] {
            let weights: Vec<f32> = (0..16).map(|i| 0.5 * codes[i % 4] as f32 - 0.25).collect();
            let (s, m) = affine(&weights, &h, 3);
            assert!((s - 0.5).abs() < 1e-9 && (m - 0.25).abs() < 1e-9, "{s} {m}");
        }
        // The code -4 has no counterpart: the scale takes its sign from it.
        for sign in [1.0f32, -1.0] {
            let weights: Vec<f32> = (0..16).map(|i| sign * 0.5 * (i % 8 - 4) as f32).collect();
            let s = linear(&weights, &h, (-4, 3));
            assert!((s - 0.5 * f64::from(sign)).abs() < 1e-9, "{s}");
        }
        assert_eq!((linear(&[0.0; 4], &h, (-4, 3)), affine(&[0.0; 4], &h, 3)), (0.0, (0.0, 0.0)));
    }

    #[test]
    fn a_negative_min_becomes_zero() {
        let weights: Vec<f32> = (0..16).map(|i| 1.0 + 0.1 * (i % 4) as f32).collect();
        let (s, m) = affine(&weights, &[1.0; 16], 3);
        assert!(s > 0.0 && m == 0.0, "{s} {m}");
    }
}
