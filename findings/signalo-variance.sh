#!/bin/sh
# signalo_filters 0.6.1 (crates.io): MeanVariance, "a mean/variance filter producing the moving average and variance", takes the sum of its window for the old mean in its update. The mean that it gives is right; the variance depends on
# the middle of the signal: of noise with a variance of 0.33 around 10, with a window of 8, it goes from -30.7 to 30.1, and around 100 ten times that; every second one is negative. A Kalman filter or a noise gate on a sensor
# that measures gravity or a supply's voltage gets that as its measurement noise. Around 0, as a test signal is, it is nearly right (-0.18 to 2.02, where 0.04 to 0.65 are true). mean::exp::MeanVariance of the same crate is
# right. There is no error.
# Seen on 2026-11-30:  around 10: mean 10.01, variance -30.7 to 30.1, 48 % below 0   around 100: -312 to 289   exponential, around 100: 0.11 to 0.57   true: 0.04 to 0.65
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "variance"
version = "0.0.0"
edition = "2021"

[dependencies]
signalo_filters = { version = "=0.6.1", features = ["std"] }
TOML
cat > src/main.rs <<'RS'
use signalo_filters::mean::exp::mean_variance::{Config, MeanVariance as Exponential};
use signalo_filters::mean::mean_variance::MeanVariance;
use signalo_filters::traits::{Filter, WithConfig};

/// Noise between -1 and 1, whose variance is 1/3, the same each time.
fn noise(count: usize) -> Vec<f64> {
    let mut state = 1u64;
    (0..count).map(|_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }).collect()
}

/// The mean of the means, the least and the greatest variance, and the share of negative ones.
fn shown(outputs: Vec<(f64, f64)>) -> [f64; 4] {
    let outputs = &outputs[50..];
    let count = outputs.len() as f64;
    let negative = outputs.iter().filter(|output| output.1 < 0.0).count() as f64 / count;
    [outputs.iter().map(|output| output.0).sum::<f64>() / count, outputs.iter().map(|output| output.1).fold(f64::MAX, f64::min), outputs.iter().map(|output| output.1).fold(f64::MIN, f64::max), negative]
}

fn moving(middle: f64) -> [f64; 4] {
    let mut filter: MeanVariance<f64, 8> = MeanVariance::default();
    shown(noise(2000).into_iter().map(|value| filter.filter(middle + value)).map(|output| (output.mean, output.variance)).collect())
}

fn exponential(middle: f64) -> [f64; 4] {
    let mut filter = Exponential::with_config(Config { inverse_width: 1.0 / 8.0 });
    shown(noise(2000).into_iter().map(|value| filter.filter(middle + value)).map(|output| (output.mean, output.variance)).collect())
}

/// The true variances of the same windows.
fn truth() -> (f64, f64) {
    let signal = noise(2000);
    let variances: Vec<f64> = signal.windows(8).map(|window| {
        let mean = window.iter().sum::<f64>() / 8.0;
        window.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 8.0
    }).collect();
    (variances.iter().copied().fold(f64::MAX, f64::min), variances.iter().copied().fold(f64::MIN, f64::max))
}

fn main() {
    let (zero, ten, hundred, other, truth) = (moving(0.0), moving(10.0), moving(100.0), exponential(100.0), truth());
    println!("SEEN mean, least and greatest variance, share below 0: around 0 {zero:.2?}, 10 {ten:.2?}, 100 {hundred:.1?}; exponential around 100 {other:.2?}; true {truth:.2?}");
    assert!((ten[0] - 10.0).abs() < 0.1 && (hundred[0] - 100.0).abs() < 0.1 && truth.0 > 0.0 && truth.1 < 0.7);
    assert!(zero[2] < 3.0 && ten[1] < -20.0 && ten[2] > 20.0 && ten[3] > 0.4 && hundred[1] < -200.0 && hundred[2] > 200.0);
    assert!(other[1] > 0.0 && other[2] < 0.7);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
