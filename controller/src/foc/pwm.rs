//! Space-vector modulation.

/// Duty cycles, 0 to 1, of the three half bridges for phase voltages whose sum is 0, from a supply of `supply` volts
/// above 0.
///
/// Half of the largest and the smallest voltage is taken from all three, which centres them, and is space-vector
/// modulation with both zero vectors equally long (Zhou and Wang, Relationship between space-vector modulation and
/// three-phase carrier-based PWM, 2002). Voltages up to `supply` / sqrt(3) are reached; more is cut.
pub fn duties([a, b, c]: [f32; 3], supply: f32) -> [f32; 3] {
    let centre = 0.5 * (a.max(b).max(c) + a.min(b).min(c));
    #[expect(clippy::manual_clamp, reason = "where voltages are beyond all bounds, no duty cycle is a NaN")]
    [a, b, c].map(|phase| (0.5 + (phase - centre) / supply).max(0.0).min(1.0))
}
