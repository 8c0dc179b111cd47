#!/bin/sh
# kfilter 0.5.1, nalgebra 0.34.2 (crates.io, Kalman filters without std): the unscented filter with its default parameters is wrong in f32, the type
# of a microcontroller. UKFParameters::default() has an alpha of 0.001, so that the sigma points have weights of up to a million, with opposite signs,
# and f32 has seven digits. A state at 10 m that moves by 0.1 m in a step is predicted at 10.5, then 11.0, 11.0, 11.5, and with exact measurements
# each step the estimate is off by up to 1.1 m. The plain filter of the package is right in f32, and the unscented one in f64, or with an alpha of
# 0.5. The type is generic, and the documentation says nothing of it; new() takes any alpha above 0. All calls return Ok.
# Seen on 2026-12-01:  predicted from 10.0 at 1 m/s and 0.1 s: f32 10.5, f64 10.1000000, f32 with alpha 0.5 10.099999   worst of 5 updates: 1.145,
#                      1e-9, 3e-6
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "single"
version = "0.0.0"
edition = "2021"

[dependencies]
kfilter = "=0.5.1"
nalgebra = "=0.34.2"
TOML
cat > src/main.rs <<'RS'
use kfilter::{measurement::LinearMeasurement, system::LinearNoInputSystem, ukf::UKFParameters, *};
use nalgebra::{RealField, SMatrix, SVector};

fn number<T: RealField + Copy>(value: f64) -> T {
    nalgebra::convert(value)
}

/// The first prediction of a place that is at 10 m and moves at 1 m/s, and the greatest error after an exact measurement in five steps of 0.1 s.
fn run<T: RealField + Copy + Into<f64>>(unscented: Option<UKFParameters<T>>) -> (f64, f64) {
    let transition = SMatrix::<T, 2, 2>::new(number(1.0), number(0.1), number(0.0), number(1.0));
    let noise = SMatrix::<T, 2, 2>::identity() * number::<T>(0.001);
    let state = SVector::<T, 2>::new(number(10.0), number(1.0));
    let covariance = SMatrix::<T, 2, 2>::identity() * number::<T>(0.01);
    let mut plain = KalmanLinearNoInput::new(transition, noise, state, covariance);
    let mut sigma = unscented.map(|parameters| {
        let system = LinearNoInputSystem::new(transition, noise, state);
        UKFLinearNoInput::<T, 2, 5>::new_custom_with_params(system, covariance, parameters)
    });
    let (mut first, mut worst) = (0.0, 0.0_f64);
    for step in 1..=5 {
        let place = 10.0 + 0.1 * f64::from(step);
        let measured = SVector::<T, 1>::new(number(place));
        let measurement = LinearMeasurement::new(SMatrix::<T, 1, 2>::new(number(1.0), number(0.0)), SMatrix::<T, 1, 1>::new(number(0.01)), measured);
        let (predicted, updated): (f64, f64) = match &mut sigma {
            Some(filter) => (filter.predict().unwrap()[0].into(), filter.update(&measurement).unwrap()[0].into()),
            None => (plain.predict().unwrap()[0].into(), plain.update(&measurement).unwrap()[0].into()),
        };
        if step == 1 {
            first = predicted;
        }
        worst = worst.max((updated - place).abs());
    }
    (first, worst)
}

fn main() {
    let single = run::<f32>(Some(UKFParameters::default()));
    let double = run::<f64>(Some(UKFParameters::default()));
    let wide = run::<f32>(Some(UKFParameters::new(0.5, 2.0, 0.0).unwrap()));
    let plain = run::<f32>(None);
    for (name, (first, worst)) in [("f32", single), ("f64", double), ("f32, alpha 0.5", wide), ("plain filter, f32", plain)] {
        println!("SEEN {name}: predicted 10.1 as {first:.7}, worst error of five updates {worst:.2e}");
    }
    assert!((single.0 - 10.1).abs() > 0.05 && single.1 > 0.1);
    assert!(double.1 < 1e-6 && wide.1 < 1e-4 && plain.1 < 1e-4);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
