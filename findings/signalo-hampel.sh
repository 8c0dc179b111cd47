#!/bin/sh
# signalo_filters 0.6.1 (crates.io): the outlier filter Hampel is documented to estimate the deviation by the median absolute deviation of its window; it takes the greater one of two distances to the median, that of the least and that of the
# greatest value, and the latter is wrong too: Median::max(), "the current max value", is the newest one. So spikes upward are removed and spikes downward let each other pass: of spikes that come every 4 samples to noise of a
# standard deviation of 1, with a window of 9 and a threshold of 3, those of 100 are removed and those of -100 all pass but the first. Of spikes of 5 deviations, 3 of 4 pass. The textbook's filter of the same past samples
# removes all of 100 and -100, and 96 % of 5. There is no error.
# Seen on 2026-11-30:  of 990 spikes of 100, 0 pass (textbook: 0)   of -100: 989 (0)   of 99 spikes of 5: 74 (4)   max() of 9, 2, 3, 1.5, 1: 1 (9)
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "hampel"
version = "0.0.0"
edition = "2021"

[dependencies]
signalo_filters = { version = "=0.6.1", features = ["std"] }
TOML
cat > src/main.rs <<'RS'
use signalo_filters::hampel::{Config, Hampel};
use signalo_filters::median::Median;
use signalo_filters::traits::{Filter, WithConfig};

const WINDOW: usize = 9;
const THRESHOLD: f64 = 3.0;

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The textbook's filter: the window's median, and 1.4826 times the median of the distances to it.
fn textbook(past: &[f64], input: f64) -> f64 {
    let middle = median(past.to_vec());
    let deviation = 1.4826 * median(past.iter().map(|value| (value - middle).abs()).collect());
    if (input - middle).abs() > THRESHOLD * deviation { middle } else { input }
}

/// Noise of a standard deviation of about 1, the same each time.
fn noise(count: usize) -> Vec<f64> {
    let mut state = 1u64;
    (0..count).map(|_| (0..12).map(|_| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }).sum::<f64>() - 6.0).collect()
}

/// The number of spikes of a height that get through, by the package and by the textbook, and of all.
fn passed(height: f64, every: usize) -> (usize, usize, usize) {
    let mut signal = noise(4000);
    let spikes: Vec<usize> = (40..4000).step_by(every).collect();
    for &spike in &spikes {
        signal[spike] = height;
    }
    let mut filter: Hampel<f64, WINDOW> = Hampel::with_config(Config { threshold: THRESHOLD });
    let package: Vec<f64> = signal.iter().map(|&value| filter.filter(value)).collect();
    let own: Vec<f64> = (0..signal.len()).map(|at| if at < WINDOW { signal[at] } else { textbook(&signal[at - WINDOW..at], signal[at]) }).collect();
    let through = |output: &[f64]| spikes.iter().filter(|&&spike| output[spike] == height).count();
    (through(&package), through(&own), spikes.len())
}

fn main() {
    let (up, down, small) = (passed(100.0, 4), passed(-100.0, 4), passed(5.0, 40));
    let mut filter: Median<f64, 5> = Median::default();
    for value in [1.0, 9.0, 2.0, 3.0, 1.5, 1.0] {
        filter.filter(value);
    }
    let (least, middle, greatest) = (filter.min().unwrap(), filter.median().unwrap(), filter.max().unwrap());
    println!("SEEN spikes that pass, textbook's, all: of 100: {up:?}, of -100: {down:?}, of 5: {small:?}; window 9, 2, 3, 1.5, 1: min {least}, median {middle}, max {greatest}");
    assert!(up.0 == 0 && up.1 == 0 && down.0 == 989 && down.1 == 0 && up.2 == 990);
    assert!(small.0 > 60 && small.1 < 10 && small.2 == 99);
    assert!(least == 1.0 && middle == 2.0 && greatest == 1.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
