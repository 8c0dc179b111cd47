//! The observer, with a turning sensor.

use std::f64::consts::TAU;

use actq_controller::foc::Observer;

/// Returns the degrees between two angles in radians.
fn degrees_between(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(TAU);
    difference.min(TAU - difference).to_degrees()
}

/// The error is below a quarter of a degree, which is the arctangent's error amplified by the gains, at any valid
/// amplitude.
#[test]
fn constant_speed_is_followed_without_lag() {
    for (tick, most) in [(1e-3, 0.25), (125e-6, 0.18)] {
        for speed in [0.0, 20.0, -300.0, 1000.0, -2000.0] {
            let mut observer = Observer::new(1000.0, tick as f32);
            let mut worst = 0.0f64;
            for i in 0..20_000 {
                let angle = 1.0 + speed * tick * f64::from(i);
                let amplitude = 1.0 + 0.2 * (f64::from(i) * 0.01).sin();
                let (sin, cos) = ((amplitude * angle.sin()) as f32, (amplitude * angle.cos()) as f32);
                let seen = observer.step(sin, cos, 1.5).expect("a turning magnet");
                assert!(seen.abs() <= 3.2, "{seen}");
                if i > 200 {
                    worst = worst.max(degrees_between(seen.into(), angle + 1.5 * speed * tick));
                }
            }
            assert!(worst < most, "{speed} rad/s in ticks of {tick} s: {worst} degrees");
        }
    }
}

#[test]
fn a_lost_sensor_is_detected_and_restarted() {
    let mut observer = Observer::new(1000.0, 1e-3);
    for _ in 0..10 {
        assert!(observer.step(0.0, 1.0, 0.0).is_some());
    }
    for (sin, cos) in [(0.0, 0.4), (0.0, 1.6), (0.0, 0.0), (f32::NAN, 1.0), (1.0, f32::NEG_INFINITY)] {
        assert_eq!(observer.step(sin, cos, 0.0), None, "{sin} {cos}");
    }
    let angle = observer.step(-1.0, 0.0, 1.5).expect("the sensor is back");
    assert!((angle + std::f32::consts::FRAC_PI_2).abs() < 1e-6, "no speed remains from before: {angle}");
}
