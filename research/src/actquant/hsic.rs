//! The Hilbert-Schmidt independence criterion (Gretton et al., "Measuring Statistical Dependence with Hilbert-Schmidt
//! Norms", 2005, equation 9): `HSIC(A, B) = tr(K_A H K_B H) / (n - 1)^2` with `H = I - 11'/n`, the biased estimate from
//! n samples.

use ndarray::{Array1, Array2, Axis};

/// Width of a Gaussian kernel. Of an even number of pairs, the upper middle one is the median; if it is 0, the mean
/// replaces it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bandwidth {
    /// `sigma^2` is the median of the squared distances: the usual heuristic, independent of the samples' scale.
    Median,
    /// `sigma` is that median, but at least 0.01, as in ActQuant's code. Samples on a small scale then look far apart,
    /// and samples on a large one alike.
    SquaredMedian,
}

/// Least `sigma` of [`Bandwidth::SquaredMedian`].
const MIN_SIGMA: f64 = 1e-2;

/// A centred kernel matrix `H K H` of n samples.
#[derive(Clone, Debug)]
pub struct Kernel(Array2<f64>);

impl Kernel {
    /// Returns the linear kernel `k(a, b) = a'b` of `samples`, `[sample, element]`.
    pub fn linear(samples: &Array2<f64>) -> Self {
        let centred = centred(samples);
        Self(centred.dot(&centred.t()))
    }

    /// Returns the Gaussian kernel `k(a, b) = exp(-|a - b|^2 / (2 sigma^2))` of `samples`, `[sample, element]`.
    ///
    /// `sigma` follows from `|a - b|^2` over all pairs of different samples. If all samples are equal, the kernel is
    /// zero.
    pub fn gaussian(samples: &Array2<f64>, bandwidth: Bandwidth) -> Self {
        let mut kernel = squared_distances(samples);
        let median = median_or_mean(&kernel);
        if median == 0.0 {
            return Self(Array2::zeros(kernel.raw_dim()));
        }
        let sigma2 = match bandwidth {
            Bandwidth::Median => median,
            Bandwidth::SquaredMedian => median.max(MIN_SIGMA).powi(2),
        };
        kernel.mapv_inplace(|d| (-d / (2.0 * sigma2)).exp());
        // K is symmetric: its row means are its column means.
        let means = means(&kernel);
        let all = means.mean().unwrap_or(0.0);
        for ((i, j), k) in kernel.indexed_iter_mut() {
            *k += all - means[i] - means[j];
        }
        Self(kernel)
    }
}

/// Returns `HSIC(A, B)`; 0 for fewer than two samples.
///
/// # Panics
///
/// If the kernels have different numbers of samples.
pub fn hsic(a: &Kernel, b: &Kernel) -> f64 {
    let n = a.0.nrows();
    // tr(K_A H K_B H) = tr(H K_A H H K_B H), as H H = H; both factors are symmetric.
    if n < 2 { 0.0 } else { (&a.0 * &b.0).sum() / ((n - 1) as f64).powi(2) }
}

fn means(samples: &Array2<f64>) -> Array1<f64> {
    samples.mean_axis(Axis(0)).unwrap_or_default()
}

fn centred(samples: &Array2<f64>) -> Array2<f64> {
    if samples.is_empty() { samples.clone() } else { samples - &means(samples) }
}

/// Returns `|a - b|^2` of all pairs. Centring first keeps the cancellation in `|a|^2 + |b|^2 - 2 a'b` small.
fn squared_distances(samples: &Array2<f64>) -> Array2<f64> {
    let centred = centred(samples);
    let mut distances = centred.dot(&centred.t());
    let squares = distances.diag().to_owned();
    // Rounding noise of equal samples counts as 0.
    let noise = 1e-12 * squares.iter().copied().fold(0.0, f64::max);
    for ((i, j), d) in distances.indexed_iter_mut() {
        let exact = squares[i] + squares[j] - 2.0 * *d;
        *d = if exact > noise { exact } else { 0.0 };
    }
    distances
}

fn median_or_mean(distances: &Array2<f64>) -> f64 {
    let mut pairs: Vec<f64> =
        distances.indexed_iter().filter(|((i, j), _)| i < j).map(|(_, distance)| *distance).collect();
    if pairs.is_empty() {
        return 0.0;
    }
    let middle = pairs.len() / 2;
    let median = *pairs.select_nth_unstable_by(middle, f64::total_cmp).1;
    if median > 0.0 { median } else { pairs.iter().sum::<f64>() / pairs.len() as f64 }
}

#[cfg(test)]
mod tests {
    use actq::random::Random;

    use super::*;

    /// Draws samples from a small deterministic generator, uniform in -1..1.
    fn samples(n: usize, len: usize, seed: u64) -> Array2<f64> {
        let mut random = Random::new(seed);
        Array2::from_shape_fn((n, len), |_| f64::from(random.unit()))
    }

    /// Computes the definition, with H written out.
    fn definition(ka: &Array2<f64>, kb: &Array2<f64>) -> f64 {
        let n = ka.nrows();
        let h = Array2::from_shape_fn((n, n), |(i, j)| f64::from(u8::from(i == j)) - 1.0 / n as f64);
        ka.dot(&h).dot(kb).dot(&h).diag().sum() / ((n - 1) * (n - 1)) as f64
    }

    fn gaussian_by_definition(x: &Array2<f64>) -> Array2<f64> {
        let n = x.nrows();
        let distance = |i: usize, j: usize| (0..x.ncols()).map(|k| (x[(i, k)] - x[(j, k)]).powi(2)).sum::<f64>();
        let mut pairs: Vec<f64> =
            (0..n).flat_map(|j| (0..j).map(move |i| (i, j))).map(|(i, j)| distance(i, j)).collect();
        pairs.sort_by(f64::total_cmp);
        let sigma2 = pairs[pairs.len() / 2];
        Array2::from_shape_fn((n, n), |(i, j)| (-distance(i, j) / (2.0 * sigma2)).exp())
    }

    #[test]
    fn agrees_with_the_definition() {
        for n in [2, 3, 9, 20] {
            let (x, y) = (samples(n, 3, 1), samples(n, 2, 2));
            let linear = y.dot(&y.t());
            let gaussian = gaussian_by_definition(&x);
            let found = hsic(&Kernel::gaussian(&x, Bandwidth::Median), &Kernel::linear(&y));
            assert!((found - definition(&gaussian, &linear)).abs() < 1e-12, "n = {n}");
            let with_itself = hsic(&Kernel::gaussian(&x, Bandwidth::Median), &Kernel::gaussian(&x, Bandwidth::Median));
            assert!((with_itself - definition(&gaussian, &gaussian)).abs() < 1e-12, "n = {n}");
        }
    }

    #[test]
    fn hsic_separates_dependent_from_independent_samples() {
        let (x, other) = (samples(400, 2, 3), samples(400, 1, 4));
        let of_x = Array2::from_shape_fn((400, 1), |(i, _)| (3.0 * x[(i, 0)]).sin());
        let kernel = Kernel::gaussian(&x, Bandwidth::Median);
        let score = |y: &Array2<f64>| hsic(&kernel, &Kernel::gaussian(y, Bandwidth::Median));
        assert!(score(&of_x) > 10.0 * score(&other), "{} against {}", score(&of_x), score(&other));
        assert!(score(&other) < 1e-3);
    }

    #[test]
    fn kernels_ignore_translation_and_the_gaussian_one_scale() {
        let (x, y) = (samples(30, 4, 5), samples(30, 2, 6));
        let base = hsic(&Kernel::gaussian(&x, Bandwidth::Median), &Kernel::linear(&y));
        let moved = hsic(&Kernel::gaussian(&(&x * 7.0 + 40.0), Bandwidth::Median), &Kernel::linear(&(&y - 9.0)));
        assert!((moved - base).abs() < 1e-9 * base, "{moved} against {base}");
    }

    #[test]
    fn the_squared_median_is_another_bandwidth() {
        // Squared distances 1, 4 and 1 * 9: the median is 4, sigma either 2 or 4.
        let x = Array2::from_shape_vec((3, 1), vec![0.0, 1.0, 3.0]).expect("three samples");
        for (bandwidth, sigma2) in [(Bandwidth::Median, 4.0), (Bandwidth::SquaredMedian, 16.0)] {
            let kernel = x.dot(&Array2::ones((1, 3))) - Array2::<f64>::ones((3, 1)).dot(&x.t());
            let kernel = kernel.mapv(|d| (-d * d / (2.0 * sigma2)).exp());
            let found = Kernel::gaussian(&x, bandwidth);
            let expected = definition(&kernel, &x.dot(&x.t()));
            assert!((hsic(&found, &Kernel::linear(&x)) - expected).abs() < 1e-12, "{bandwidth:?}");
        }
        // On this small scale, sigma is the least one, and all samples nearly coincide.
        let small = Kernel::gaussian(&(&x * 1e-3), Bandwidth::SquaredMedian);
        assert!(small.0.iter().all(|k| k.abs() < 0.05), "{small:?}");
    }

    #[test]
    fn constant_and_single_samples_give_zero() {
        let y = Kernel::linear(&samples(12, 2, 7));
        for constant in [Array2::from_elem((12, 3), 0.1), Array2::zeros((12, 3)), Array2::zeros((12, 0))] {
            assert_eq!(hsic(&Kernel::gaussian(&constant, Bandwidth::Median), &y), 0.0);
            assert!(hsic(&Kernel::linear(&constant), &y).abs() < 1e-12);
        }
        let one = samples(1, 3, 8);
        assert_eq!(hsic(&Kernel::gaussian(&one, Bandwidth::Median), &Kernel::linear(&one)), 0.0);
    }

    #[test]
    fn mostly_equal_samples_use_the_mean_distance() {
        let mut x = Array2::zeros((10, 1));
        x[(0, 0)] = 1.0;
        let kernel = Kernel::gaussian(&x, Bandwidth::Median);
        let score = hsic(&kernel, &kernel);
        assert!(score.is_finite() && score > 0.0, "{score}");
    }
}
