//! llama.cpp's IQ2_XS, simulated: eight weights of a group share one point of a grid, and their signs.
//!
//! A super-block is 256 weights: d in f16, and a 4-bit scale s for each 16 weights. Each 8 weights have 9 bits that
//! choose a point of the grid, and 7 bits of signs. The number of negative signs is even, so the last sign follows from
//! the others. A weight is `d (2 s + 1) / 8` times its signed magnitude, which is 8, 25 or 43.
//!
//! The grid here is not llama.cpp's, but has its size, magnitudes and rate ([`Grid::new`]).

use std::sync::LazyLock;

use half::f16;

use super::fit::{self, Term};

/// Bits per weight: 2 bytes of d, 8 bytes of scales, and 2 bytes for each of 32 groups, for 256 weights.
pub(super) const BITS_PER_WEIGHT: f64 = 8.0 * (2 + 8 + 2 * 32) as f64 / 256.0;

/// Weights that share a point of the grid.
const GROUP: usize = 8;
/// Weights that share a scale.
const SUB_BLOCK: usize = 16;
/// Points of the grid: 9 bits.
const POINTS: usize = 512;
const MAGNITUDES: [u8; 3] = [8, 25, 43];
/// Largest scale: 4 bits.
const TOP: i32 = 15;

/// Candidates for a sub-block's scale before it is rounded, in equal ratios.
const CANDIDATES: usize = 12;
/// The first candidate, as a multiple of the weights' root mean square per unit of magnitude.
const NARROWEST: f64 = 0.18 / 8.0;
/// The last candidate is at least this multiple.
const WIDEST: f64 = 0.5 / 8.0;
/// Rounds of choosing scales and points and then d.
const ROUNDS: usize = 2;

/// The magnitudes of the grid's points, a row for each of the eight weights.
struct Grid([[f32; POINTS]; GROUP]);

static GRID: LazyLock<Grid> = LazyLock::new(Grid::new);

impl Grid {
    /// Takes the 512 points of least norm whose number of middle magnitudes is even, in lexicographic order among
    /// equals.
    ///
    /// With 1, 3 and 5 for the magnitudes and an even number of negative signs, these are points of the lattice E8, the
    /// densest packing in eight dimensions. All coordinates are odd, and their sum is a multiple of 4. (QuIP#, arXiv
    /// 2402.04396, takes its codebook from E8, too.)
    fn new() -> Self {
        let digits = |point: usize| (0..GROUP).rev().map(move |i| point / 3usize.pow(i as u32) % 3);
        let norm = |&point: &usize| digits(point).map(|digit| u32::from(MAGNITUDES[digit]).pow(2)).sum::<u32>();
        let middle = |&point: &usize| digits(point).filter(|digit| *digit == 1).count();
        let mut points: Vec<usize> = (0..3usize.pow(GROUP as u32)).filter(|point| middle(point) % 2 == 0).collect();
        points.sort_by_key(norm);
        let mut magnitudes = [[0.0; POINTS]; GROUP];
        for (at, &point) in points.iter().take(POINTS).enumerate() {
            digits(point).zip(&mut magnitudes).for_each(|(digit, row)| row[at] = f32::from(MAGNITUDES[digit]));
        }
        Self(magnitudes)
    }

    /// Returns the signed magnitudes that come nearest to `weights / scale`, for scales above 0. Weights missing in a
    /// group count as zeros of no importance.
    fn nearest(&self, weights: &[f32], importance: &[f64], scale: f64) -> [f32; GROUP] {
        let (mut size, mut h) = ([0f32; GROUP], [0f32; GROUP]);
        // Importances of any unit fit f32.
        let unit = importance.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        for (i, (w, importance)) in weights.iter().zip(importance).enumerate() {
            (size[i], h[i]) = ((f64::from(w.abs()) / scale) as f32, (importance / unit) as f32);
        }
        let mut cost = [0f32; POINTS];
        for i in 0..GROUP {
            for (cost, m) in cost.iter_mut().zip(&self.0[i]) {
                *cost += h[i] * m * (m - 2.0 * size[i]);
            }
        }
        let odd = weights.iter().filter(|w| w.is_sign_negative()).count() % 2 == 1;
        if odd {
            // One weight takes the wrong sign: the one at which it costs least.
            let mut least = [f32::INFINITY; POINTS];
            for i in 0..GROUP {
                let flip = 4.0 * h[i] * size[i];
                least.iter_mut().zip(&self.0[i]).for_each(|(least, m)| *least = least.min(flip * m));
            }
            cost.iter_mut().zip(&least).for_each(|(cost, least)| *cost += least);
        }
        let best = (0..POINTS).min_by(|&a, &b| cost[a].total_cmp(&cost[b])).unwrap_or(0);
        let mut signed = std::array::from_fn(|i| match weights.get(i) {
            Some(w) if w.is_sign_negative() => -self.0[i][best],
            _ => self.0[i][best],
        });
        if odd {
            let cost = |i: &usize| h[*i] * size[*i] * self.0[*i][best];
            let flipped = (0..GROUP).min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(0);
            signed[flipped] = -signed[flipped];
        }
        signed
    }
}

/// The signed magnitudes of a sub-block, and their weighted squared error at a scale.
fn choose(weights: &[f32], importance: &[f64], scale: f64) -> (Vec<f32>, f64) {
    let groups = weights.chunks(GROUP).zip(importance.chunks(GROUP));
    let chosen: Vec<f32> = groups.flat_map(|(w, h)| GRID.nearest(w, h, scale).into_iter().take(w.len())).collect();
    let error = |((w, q), h): ((&f32, &f32), &f64)| h * (scale * f64::from(*q) - f64::from(*w)).powi(2);
    let error = weights.iter().zip(&chosen).zip(importance).map(error).sum();
    (chosen, error)
}

/// Returns the factor of least weighted squared error from magnitudes to weights.
fn factor<'a>(terms: impl Iterator<Item = ((&'a f32, f64), &'a f64)>) -> f64 {
    let term = |((w, a), h): ((&f32, f64), &f64)| Term { importance: *h, weight: f64::from(*w), a, b: 0.0 };
    fit::least_squares(terms.map(term)).0
}

/// Fits the scale of a sub-block, before it is rounded.
fn scale(weights: &[f32], importance: &[f64]) -> f64 {
    let (sum, total) = weights
        .iter()
        .zip(importance)
        .fold((0.0, 0.0), |(sum, total), (w, h)| (sum + h * f64::from(*w).powi(2), total + h));
    let largest = weights.iter().fold(0.0, |m: f64, w| m.max(f64::from(w.abs())));
    if largest == 0.0 {
        return 0.0;
    }
    // Without importance the largest weight decides.
    let root = if sum > 0.0 { (sum / total).sqrt() } else { largest };
    let low = NARROWEST * root;
    let high = (WIDEST * root).max(largest / f64::from(MAGNITUDES[2]));
    let mut best = (f64::INFINITY, 0.0);
    for step in 0..CANDIDATES {
        let candidate = low * (high / low).powf(step as f64 / (CANDIDATES - 1) as f64);
        let (chosen, _) = choose(weights, importance, candidate);
        let fitted = factor(weights.iter().zip(chosen.iter().map(|q| f64::from(*q))).zip(importance));
        let error = weights.iter().zip(&chosen).zip(importance);
        let error: f64 = error.map(|((w, q), h)| h * (fitted * f64::from(*q) - f64::from(*w)).powi(2)).sum();
        if error < best.0 {
            best = (error, fitted);
        }
    }
    best.1.max(0.0)
}

/// A super-block; the last of a row may be short.
struct Block {
    d: f16,
    /// One per sub-block.
    scales: Vec<i32>,
    /// Signed magnitudes.
    codes: Vec<f32>,
}

impl Block {
    fn fit(weights: &[f32], importance: &[f64]) -> Self {
        let fitted: Vec<f64> =
            weights.chunks(SUB_BLOCK).zip(importance.chunks(SUB_BLOCK)).map(|(w, h)| scale(w, h)).collect();
        let largest = fitted.iter().copied().fold(0.0, f64::max);
        let mut block =
            Self { d: f16::from_f64(8.0 * largest / f64::from(2 * TOP + 1)), scales: Vec::new(), codes: Vec::new() };
        if block.d == f16::ZERO {
            // No scale makes a point of the grid zero; d does.
            block.scales = vec![0; fitted.len()];
            block.codes = vec![0.0; weights.len()];
            return block;
        }
        let d = block.d.to_f64();
        block.scales = fitted.iter().map(|s| (((8.0 * s / d - 1.0) / 2.0).round() as i32).clamp(0, TOP)).collect();
        for _ in 0..ROUNDS {
            block.choose_codes(weights, importance);
            block.refit(weights, importance);
        }
        block
    }

    fn multiplier(d: f16, scale: i32) -> f64 {
        d.to_f64() * f64::from(2 * scale + 1) / 8.0
    }

    /// Chooses for every sub-block the scale, next to the present one, and the points that come nearest to the weights.
    fn choose_codes(&mut self, weights: &[f32], importance: &[f64]) {
        self.codes.clear();
        for (i, (w, h)) in weights.chunks(SUB_BLOCK).zip(importance.chunks(SUB_BLOCK)).enumerate() {
            let tries = (self.scales[i] - 1).max(0)..=(self.scales[i] + 1).min(TOP);
            let measured = tries.map(|scale| (choose(w, h, Self::multiplier(self.d, scale)), scale));
            if let Some(((codes, _), scale)) = measured.min_by(|a, b| a.0.1.total_cmp(&b.0.1)) {
                self.scales[i] = scale;
                self.codes.extend(codes);
            }
        }
    }

    /// Fits d to the present scales and points, if that is still better in f16.
    fn refit(&mut self, weights: &[f32], importance: &[f64]) {
        let unit = |i: usize| f64::from(self.codes[i]) * f64::from(2 * self.scales[i / SUB_BLOCK] + 1) / 8.0;
        let d = factor(weights.iter().zip((0..weights.len()).map(unit)).zip(importance));
        let (known, before) = (self.d, self.error(weights, importance));
        self.d = f16::from_f64(d);
        let after = self.error(weights, importance);
        // Also if the new value is not finite, or leaves no scale to divide by.
        if after.is_nan() || after > before || self.d <= f16::ZERO {
            self.d = known;
        }
    }

    fn error(&self, weights: &[f32], importance: &[f64]) -> f64 {
        fit::error(weights, &self.weights(), importance)
    }

    fn weights(&self) -> Vec<f32> {
        let scale = |i: usize| Self::multiplier(self.d, self.scales[i / SUB_BLOCK]) as f32;
        self.codes.iter().enumerate().map(|(i, code)| scale(i) * code).collect()
    }
}

/// Returns the weights that a super-block's points and scales represent.
pub(super) fn rounded(weights: &[f32], importance: &[f64]) -> Vec<f32> {
    Block::fit(weights, importance).weights()
}

#[cfg(test)]
mod tests {
    use actq::random::Random;

    use super::*;

    fn normal(seed: u64, len: usize) -> Vec<f32> {
        let mut random = Random::new(seed);
        (0..len).map(|_| random.normal()).collect()
    }

    #[test]
    fn grid_has_points_of_e8() {
        let points: std::collections::BTreeSet<Vec<u32>> =
            (0..POINTS).map(|at| GRID.0.iter().map(|row| row[at] as u32).collect()).collect();
        assert_eq!(points.len(), POINTS);
        for point in &points {
            let odd: u32 = point
                .iter()
                .map(|m| match m {
                    8 => 1,
                    25 => 3,
                    43 => 5,
                    _ => 100,
                })
                .sum();
            assert!(odd.is_multiple_of(4) && odd < 100, "{point:?}");
        }
        assert!(points.contains(&vec![8; 8]));
    }

    #[test]
    fn nearest_point_matches_an_exhaustive_search() {
        for seed in 0..20 {
            let weights = normal(seed, GROUP);
            let importance: Vec<f64> = normal(seed + 100, GROUP).iter().map(|h| f64::from(h * h)).collect();
            let error = |signed: &[f32]| -> f64 {
                let errors = signed.iter().zip(&weights).map(|(q, w)| f64::from(0.05 * q - w).powi(2));
                errors.zip(&importance).map(|(error, h)| error * h).sum()
            };
            let found = GRID.nearest(&weights, &importance, 0.05);
            assert_eq!(found.iter().filter(|q| **q < 0.0).count() % 2, 0);
            let signs = (0..256u32).filter(|signs| signs.count_ones() % 2 == 0);
            let all = signs.flat_map(|signs| {
                (0..POINTS).map(move |at| -> [f32; GROUP] {
                    std::array::from_fn(|i| if signs >> i & 1 == 1 { -GRID.0[i][at] } else { GRID.0[i][at] })
                })
            });
            let least = all.map(|signed| error(&signed)).fold(f64::INFINITY, f64::min);
            assert!(error(&found) <= least * (1.0 + 1e-5), "seed {seed}: {} against {least}", error(&found));
        }
    }

    #[test]
    fn short_blocks_zeros_and_representable_weights_work() {
        assert_eq!(rounded(&[0.0; 20], &[1.0; 20]), [0.0; 20]);
        for len in [1, 7, 9, 250] {
            let found = rounded(&normal(len as u64, len), &vec![1.0; len]);
            assert!(found.len() == len && found.iter().all(|w| w.is_finite()));
        }
        let once = rounded(&normal(3, 256), &[1.0; 256]);
        let again = rounded(&once, &[1.0; 256]);
        let energy: f32 = once.iter().map(|w| w * w).sum();
        let lost: f32 = once.iter().zip(&again).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(lost < 0.01 * energy, "{lost} of {energy}");
    }
}
