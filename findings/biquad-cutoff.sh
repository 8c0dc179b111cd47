#!/bin/sh
# biquad 0.4.2, 0.5.0, 0.6.0 (crates.io): in 0.5.0, Coefficients::from_params() makes every filter for a quarter of the frequency that it is given: it divides it by twice the sampling frequency, where half of it is right, as in 0.4.2
# and again in 0.6.0. A low pass of 50 Hz at 1 kHz has its -3 dB at 12.5 Hz: a loop with a filtered velocity or gyroscope lags four times as much, and a notch misses its resonance. A frequency of up to twice the sampling frequency
# is taken there. And in 0.4.2 and 0.6.0 a band pass has a gain of Q at its center, not 1. There is no error.
# Seen on 2026-11-30:  gain of the 50 Hz low pass at 50 Hz: 0.707, 0.061, 0.707   at 12.5 Hz: 0.998, 0.707, 0.998   900 Hz at 1 kHz: refused, taken, refused   band pass of 50 Hz and Q 5 at 50 Hz: 5.00, 0.26, 5.00
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "cutoff"
version = "0.0.0"
edition = "2021"

[dependencies]
biquad_04 = { package = "biquad", version = "=0.4.2" }
biquad_05 = { package = "biquad", version = "=0.5.0" }
biquad_06 = { package = "biquad", version = "=0.6.0" }
TOML
cat > src/main.rs <<'RS'
const SAMPLING: f64 = 1000.0;

/// The greatest output for a sine of the frequency given, after the filter has settled.
fn gain(mut filter: impl FnMut(f64) -> f64, hertz: f64) -> f64 {
    let sine = |n: i32| (std::f64::consts::TAU * hertz * f64::from(n) / SAMPLING).sin();
    (0..20_000).map(|n| (n, filter(sine(n)))).filter(|(n, _)| *n > 10_000).fold(0.0, |most, (_, y)| most.max(y.abs()))
}

macro_rules! see {
    ($version:ident) => {{
        use $version::*;
        let coefficients = |kind, hertz: f64, q| Coefficients::<f64>::from_params(kind, SAMPLING.hz(), hertz.hz(), q);
        let run = |kind, q, at| {
            let mut filter = DirectForm2Transposed::<f64>::new(coefficients(kind, 50.0, q).unwrap());
            gain(|x| filter.run(x), at)
        };
        let low = |at| run(Type::LowPass, Q_BUTTERWORTH_F64, at);
        let above = coefficients(Type::LowPass, 900.0, Q_BUTTERWORTH_F64).is_ok();
        let seen = (low(50.0), low(12.5), above, run(Type::BandPass, 5.0, 50.0));
        println!("SEEN {}: low pass at 50 Hz {:.3}, at 12.5 Hz {:.3}, 900 Hz taken {}, band pass {:.2}", stringify!($version), seen.0, seen.1, seen.2, seen.3);
        seen
    }};
}

fn main() {
    let near = |a: f64, b: f64| (a - b).abs() < 0.001;
    for (at_50, at_12, above, band) in [see!(biquad_04), see!(biquad_06)] {
        assert!(near(at_50, 0.5_f64.sqrt()) && at_12 > 0.99 && !above && near(band, 5.0));
    }
    let (at_50, at_12, above, _) = see!(biquad_05);
    assert!(at_50 < 0.07 && near(at_12, 0.5_f64.sqrt()) && above);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
