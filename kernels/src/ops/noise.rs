//! Normal noise, with the same bits on every machine.

use crate::arch::sqrt;

/// Computes a value of standard normal noise: the value at `index` of draw `draw` with `seed`. Values are independent
/// of each other, and the caller can compute them in any order.
///
/// The counter-based generator Philox2x32-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011)
/// gives the bits, and Box and Muller's transform in f32 the normal values. They are within ±5.8.
#[inline(never)]
pub fn normal(seed: u32, draw: u32, index: u32) -> f32 {
    let [a, b] = philox(seed, [index, draw]);
    // 24 bits each: the first in (0, 1], so that it has a logarithm, the second in [-0.5, 0.5).
    const UNIT: f32 = 1.0 / (1 << 24) as f32;
    let (u, v) = (((a >> 8) + 1) as f32 * UNIT, (b >> 8) as f32 * UNIT - 0.5);
    sqrt(-2.0 * ln(u)) * cos_turns(v)
}

/// Computes ten rounds of Philox on two words.
fn philox(mut key: u32, mut counter: [u32; 2]) -> [u32; 2] {
    for _ in 0..10 {
        let product = u64::from(counter[0]) * 0xd256_d193;
        counter = [(product >> 32) as u32 ^ key ^ counter[1], product as u32];
        key = key.wrapping_add(0x9e37_79b9);
    }
    counter
}

/// Computes the natural logarithm of a normal positive number.
fn ln(x: f32) -> f32 {
    // x = m 2^e with m in [2/3, 4/3), and ln m = 2 artanh((m - 1) / (m + 1)).
    let e = (x.to_bits() as i32 - (2.0f32 / 3.0).to_bits() as i32) >> 23;
    let m = f32::from_bits((x.to_bits() as i32 - (e << 23)) as u32);
    let s = (m - 1.0) / (m + 1.0);
    let s2 = s * s;
    let series = 2.0 + s2 * (2.0 / 3.0 + s2 * (2.0 / 5.0 + s2 * (2.0 / 7.0 + s2 * (2.0 / 9.0))));
    s * series + e as f32 * core::f32::consts::LN_2
}

/// Computes the cosine of `turns` turns, within half a turn of 0: `1 - 2 sin^2` of half the angle, by its Taylor
/// series.
fn cos_turns(turns: f32) -> f32 {
    let x = turns * core::f32::consts::PI;
    let x2 = x * x;
    let series = 1.0
        - x2 * (1.0 / 6.0
            - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0 - x2 * (1.0 / 362_880.0 - x2 * (1.0 / 39_916_800.0)))));
    let sine = x * series;
    1.0 - 2.0 * (sine * sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The known answers that come with Random123, the authors' library.
    #[test]
    fn bits_are_those_of_philox() {
        assert_eq!(philox(0, [0, 0]), [0xff1d_ae59, 0x6cd1_0df2]);
        assert_eq!(philox(u32::MAX, [u32::MAX; 2]), [0x2c3f_628b, 0xab4f_d7ad]);
        assert_eq!(philox(0x1319_8a2e, [0x243f_6a88, 0x85a3_08d3]), [0xdd7c_e038, 0xf62a_4c12]);
    }

    #[test]
    fn functions_are_near_the_exact_ones() {
        for i in 1..=1 << 16 {
            let u = i as f32 / (1 << 16) as f32;
            let exact = f64::from(u).ln();
            assert!((f64::from(ln(u)) - exact).abs() <= 2e-7 * (1.0 + exact.abs()), "{u}");
            let exact = (std::f64::consts::TAU * (f64::from(u) - 0.5)).cos();
            // Four times the sine's error: that of the series' end, 6e-8, and of roundings.
            assert!((f64::from(cos_turns(u - 0.5)) - exact).abs() <= 8e-7, "{u}");
        }
        assert!((f64::from(ln(f32::from_bits(0x3380_0000))) + 24.0 * std::f64::consts::LN_2).abs() < 2e-6);
    }

    #[test]
    fn values_are_normal() {
        const N: u32 = 200_000;
        let values: std::vec::Vec<f64> = (0..N).map(|i| normal(7, i / 16, i % 16).into()).collect();
        let mean = |f: &dyn Fn(f64) -> f64| values.iter().map(|v| f(*v)).sum::<f64>() / f64::from(N);
        // Four standard errors of each.
        let near = |found: f64, expected: f64, variance: f64| {
            assert!((found - expected).abs() < 4.0 * (variance / f64::from(N)).sqrt(), "{found} for {expected}");
        };
        near(mean(&|v| v), 0.0, 1.0);
        near(mean(&|v| v * v), 1.0, 2.0);
        near(mean(&|v| v.powi(3)), 0.0, 15.0);
        near(mean(&|v| v.powi(4)), 3.0, 96.0);
        near(mean(&|v| f64::from(u8::from(v.abs() > 1.96))), 0.05, 0.0475);
        let neighbours = values.windows(2).map(|v| v[0] * v[1]).sum::<f64>() / f64::from(N);
        near(neighbours, 0.0, 1.0);
        assert!(values.iter().all(|v| v.abs() < 5.8));
        assert_eq!([normal(0, 0, 0).to_bits(), normal(1, 2, 3).to_bits()], [1_033_359_405, 1_063_383_619]);
    }
}
