//! Space-vector modulation.

/// Returns the duty cycles, 0 to 1, of the three half bridges for phase voltages whose sum is 0, from a positive supply
/// of `supply` volts.
///
/// It subtracts the mean of the largest and the smallest voltage from all three, which centres them. This is
/// space-vector modulation with two zero vectors of equal length (Zhou and Wang, Relationship between space-vector
/// modulation and three-phase carrier-based PWM, 2002). It reaches voltages up to `supply` / sqrt(3) and clips larger
/// ones.
pub fn duties([a, b, c]: [f32; 3], supply: f32) -> [f32; 3] {
    let centre = 0.5 * (a.max(b).max(c) + a.min(b).min(c));
    #[expect(clippy::manual_clamp, reason = "no duty cycle is a NaN, even for infinite voltages")]
    [a, b, c].map(|phase| (0.5 + (phase - centre) / supply).max(0.0).min(1.0))
}
