//! The errors of sine, cosine, arctangent and inverse root, against f64.

use std::f64::consts::PI;

use actq_controller::foc::functions::{MAX_RADIANS, atan2, inverse_root_below, sin_cos};

/// Returns the angle from one vector to another, in degrees.
fn degrees_between([x, y]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    (x * v - y * u).atan2(x * u + y * v).abs().to_degrees()
}

#[test]
fn sine_and_cosine_form_a_unit_vector() {
    let (mut angle, mut length) = (0.0f64, 0.0f64);
    for range in [PI as f32, MAX_RADIANS] {
        for i in -1_000_000..=1_000_000i32 {
            let radians = range * (i as f32 / 1e6);
            let (sin, cos) = sin_cos(radians);
            let (found, (y, x)) = ([f64::from(cos), f64::from(sin)], f64::from(radians).sin_cos());
            angle = angle.max(degrees_between(found, [x, y]));
            length = length.max((found[0].hypot(found[1]) - 1.0).abs());
        }
    }
    assert!((0.06..0.068).contains(&angle), "{angle} degrees");
    assert!((1e-7..2e-6).contains(&length), "{length}");
}

#[test]
fn arctangent_is_accurate_at_every_angle_and_length() {
    let mut worst = 0.0f64;
    for length in [0.5f32, 1.0, 1.5, 1e3] {
        for i in -500_000..=500_000 {
            let (y, x) = (PI * f64::from(i) / 5e5).sin_cos();
            let (y, x) = (length * y as f32, length * x as f32);
            let (sin, cos) = f64::from(atan2(y, x)).sin_cos();
            worst = worst.max(degrees_between([cos, sin], [x.into(), y.into()]));
        }
    }
    assert!((0.16..0.163).contains(&worst), "{worst} degrees");
    for (y, x, radians) in [(0.0, 1.0, 0.0), (1.0, 0.0, PI / 2.0), (-1.0, 0.0, -PI / 2.0), (0.0, -1.0, PI)] {
        assert!((f64::from(atan2(y, x)) - radians).abs() < 1e-6, "{y} {x}");
    }
}

/// All numbers of two octaves, which represent all octaves: the estimate depends only on the exponent's parity.
#[test]
fn inverse_root_is_below_and_close() {
    let root = |square: f32| f64::from(square * inverse_root_below(square));
    let (mut below, mut above) = (0.0f64, 0.0f64);
    for bits in 1f32.to_bits()..4f32.to_bits() {
        let square = f32::from_bits(bits);
        let share = root(square) / f64::from(square).sqrt() - 1.0;
        (below, above) = (below.max(-share), above.max(share));
    }
    assert!((0.0017..0.001_76).contains(&below), "{below}");
    // Only rounding: a share of f32's last bit, for which the current loop's limit has a margin.
    assert!(above < 2.4e-7, "{above}");
    for square in [0.0, 1e-45, 1e-40, f32::MIN_POSITIVE, f32::MAX] {
        let (root, exact) = (root(square), f64::from(square).sqrt());
        assert!((0.0..=exact * (1.0 + 2.4e-7)).contains(&root), "{square}: {root} of {exact}");
    }
}
