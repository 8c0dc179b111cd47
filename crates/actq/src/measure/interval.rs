//! The interval of a share.

/// Returns the 95% interval of the share `successes / trials`, of one trial or more (Wilson: Probable inference, the
/// law of succession, and statistical inference, 1927).
pub fn wilson(successes: f64, trials: f64) -> [f64; 2] {
    /// Quantile of the normal distribution.
    const Z: f64 = 1.96;
    let (share, z2) = (successes / trials, Z * Z / trials);
    let middle = share + z2 / 2.0;
    let reach = Z * (share * (1.0 - share) / trials + z2 / (4.0 * trials)).sqrt();
    [-reach, reach].map(|side| ((middle + side) / (1.0 + z2)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_matches_worked_examples() {
        let near = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near(wilson(10.0, 10.0), [0.722, 1.0]));
        assert!(near(wilson(50.0, 100.0), [0.404, 0.596]));
        assert!(near(wilson(0.0, 20.0), [0.0, 0.161]));
    }
}
