//! Each part against its equivalent in f64, and against its requirements.

use std::f64::consts::TAU;

use actq_controller::foc::{Angle, CurrentLoop, Gains, Measured, Pi, Rotor, Stator, duties};
use proptest::prelude::*;

const SQRT_3: f64 = 1.732_050_807_568_877_2;

fn near(a: f32, b: f64, scale: f64) -> bool {
    (f64::from(a) - b).abs() <= 4.0 * f64::from(f32::EPSILON) * scale
}

fn current() -> impl Strategy<Value = f32> {
    -100.0..100.0f32
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn transforms_are_those_of_f64(phases in [current(), current(), current()], radians in -100.0..100.0f32) {
        let [a, b, c] = phases.map(f64::from);
        let (alpha, beta) = ((2.0 * a - b - c) / 3.0, (b - c) / SQRT_3);
        let stator = Stator::of_phases(phases);
        prop_assert!(near(stator.alpha, alpha, 400.0) && near(stator.beta, beta, 400.0));
        let angle = Angle::new(radians);
        let (sin, cos) = (f64::from(angle.sin), f64::from(angle.cos));
        let rotor = stator.to_rotor(angle);
        prop_assert!(near(rotor.d, alpha * cos + beta * sin, 800.0));
        prop_assert!(near(rotor.q, beta * cos - alpha * sin, 800.0));
        // The length after both transforms differs by as much as that of sine and cosine from 1.
        let longer = sin * sin + cos * cos;
        let back = rotor.to_stator(angle);
        prop_assert!(near(back.alpha, longer * alpha, 800.0) && near(back.beta, longer * beta, 800.0));
        let common = (a + b + c) / 3.0;
        let there = back.phases();
        for (there, was) in there.into_iter().zip([a, b, c]) {
            prop_assert!(near(there, longer * (was - common), 1600.0));
        }
    }

    /// Within the limit, the bridges give the requested voltage from line to line.
    #[test]
    fn duties_give_the_voltage(length in 0.0..0.577_35f32, radians in -4.0..4.0f32, supply in 1.0..800.0f32) {
        let length = f64::from(length * supply);
        let phase = |k: f64| (length * (f64::from(radians) - k * TAU / 3.0).cos()) as f32;
        let phases = [phase(0.0), phase(1.0), phase(2.0)];
        let [a, b, c] = duties(phases, supply);
        for duty in [a, b, c] {
            prop_assert!((0.0..=1.0).contains(&duty));
        }
        let scale = f64::from(supply) * 2.0;
        prop_assert!(near((a - b) * supply, f64::from(phases[0]) - f64::from(phases[1]), scale));
        prop_assert!(near((b - c) * supply, f64::from(phases[1]) - f64::from(phases[2]), scale));
        // Both zero vectors have the same length.
        prop_assert!((a.max(b).max(c) + a.min(b).min(c) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn duties_stay_within_0_and_1(phases: [f32; 3], supply in 1e-3..1e5f32) {
        for duty in duties(phases, supply) {
            prop_assert!((0.0..=1.0).contains(&duty));
        }
    }

    #[test]
    fn a_limited_controller_does_not_wind_up(errors in prop::collection::vec(-50.0..50.0f32, 1..200), limit in 0.1..20.0f32) {
        let mut pi = Pi::new();
        for error in &errors {
            let output = pi.step(*error, 0.5, 0.1, limit);
            prop_assert!(output.abs() <= limit);
        }
        // After any time at the limit, an error of opposite sign that exceeds the limit reverses the output
        // immediately.
        let largest = 2.0 * limit / 0.5 + 1.0;
        prop_assert!(pi.step(-largest, 0.5, 0.1, limit) < 0.0);
    }

    #[test]
    fn an_unlimited_controller_is_that_of_f64(errors in prop::collection::vec(-1.0..1.0f32, 1..100)) {
        let (mut pi, mut integral) = (Pi::new(), 0.0);
        for error in errors {
            let output = pi.step(error, 0.5, 0.1, 1e6);
            integral += 0.1 * f64::from(error);
            prop_assert!(near(output, 0.5 * f64::from(error) + integral, 1000.0));
        }
    }

    /// For any measurement, a tick gives valid duty cycles or `None`, and a voltage within the supply's limit.
    #[test]
    fn a_tick_gives_duties_or_nothing(values: [f32; 7], tame in [current(), current(), current()], supply in 1.0..100.0f32) {
        let mut wild = CurrentLoop::new(Gains { proportional: 0.3, integral: 0.05 });
        let mut calm = wild;
        let [a, b, c, angle, volts, d, q] = values;
        let (measured, target) = (Measured { phases: [a, b, c], angle, supply: volts }, Rotor { d, q });
        if let Some(tick) = wild.step(&measured, target) {
            prop_assert!(tick.duties.iter().all(|duty| (0.0..=1.0).contains(duty)), "{tick:?}");
        } else {
            prop_assert!(wild == calm, "the state is unchanged");
        }
        let measured = Measured { phases: tame, angle: 0.0, supply };
        for _ in 0..50 {
            let tick = calm.step(&measured, Rotor { d: 30.0, q: -60.0 }).expect("all values are finite");
            let length = f64::from(tick.voltage.d).hypot(f64::from(tick.voltage.q));
            prop_assert!(length <= f64::from(supply) / SQRT_3);
        }
    }
}

#[test]
fn a_broken_sensor_gives_no_duties() {
    let mut control = CurrentLoop::new(Gains { proportional: 0.3, integral: 0.05 });
    let (good, target) = (Measured { phases: [1.0, -2.0, 1.0], angle: 1000.0, supply: 24.0 }, Rotor { d: 0.0, q: 1.0 });
    for measured in [
        Measured { angle: 1000.1, ..good },
        Measured { angle: -1000.1, ..good },
        Measured { angle: f32::NAN, ..good },
        Measured { supply: 0.0, ..good },
        Measured { supply: 1e20, ..good },
        Measured { phases: [1.0, f32::INFINITY, 0.0], ..good },
    ] {
        assert_eq!(control.step(&measured, target), None, "{measured:?}");
    }
    assert!(control.step(&good, target).is_some());
    for wrong in [f32::NAN, f32::INFINITY] {
        for gains in [[wrong, 0.05], [0.3, wrong]] {
            let gains = Gains { proportional: gains[0], integral: gains[1] };
            assert_eq!(CurrentLoop::new(gains).step(&good, target), None, "{gains:?}");
        }
    }
}
