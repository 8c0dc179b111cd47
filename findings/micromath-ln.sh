#!/bin/sh
# micromath 2.1.0 (crates.io): ln of a number between 0 and 1 is off by up to 0.12, where ln of its reciprocal is off by 0.0001, and powf of such a base follows it. ln takes the fast
# approximation of 1/x there, which the comment beside it calls not good enough. Its test of ln, to 0.001, has powers of ten and whole numbers only. And normalize() of a quaternion
# of length 1 gives one of length 0.966, also when it is applied again: a filter that normalizes in each step never has a rotation.
# Seen on 2026-11-29:  ln 0.75: -0.405, right -0.288   ln 1/0.75: 0.288   powf(0.99, 100): 0.138, right 0.366   powf(1.5, 4): 5.062, right 5.062   normalize of 1 0 0 0: 0.966 0 0 0
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "app"
version = "0.0.0"
edition = "2021"
[dependencies]
micromath = { version = "=2.1.0", features = ["quaternion", "vector"] }
TOML
cat > src/main.rs <<'RUST'
use micromath::{F32Ext, Quaternion};

/// Prints the approximation and the right value, and gives the error.
fn show(what: &str, found: f32, right: f32) -> f32 {
    println!("{what}: {found:.3}, right {right:.3}");
    (found - right).abs()
}

fn main() {
    for x in [0.75f32, 0.9, 0.99] {
        let [below, above] = [x, 1.0 / x].map(|x| show(&format!("ln {x}"), F32Ext::ln(x), f32::ln(x)));
        assert!(above < 2e-4 && below > 0.009, "the behaviour changed");
    }
    let largest = (1..1000).map(|i| i as f32 / 1000.0).map(|x| (F32Ext::ln(x) - f32::ln(x)).abs()).fold(0.0, f32::max);
    println!("largest error of ln between 0 and 1: {largest:.3}");
    assert!(largest > 0.11);
    assert!(show("powf(0.99, 100)", F32Ext::powf(0.99, 100.0), 0.99f32.powf(100.0)) > 0.2);
    assert!(show("powf(0.75, 4)", F32Ext::powf(0.75, 4.0), 0.75f32.powf(4.0)) > 0.1);
    assert!(show("powf(1.5, 4)", F32Ext::powf(1.5, 4.0), 1.5f32.powf(4.0)) < 0.001);
    let mut attitude = Quaternion::new(1.0, 0.0, 0.0, 0.0);
    for _ in 0..3 {
        attitude = attitude.normalize();
        assert!(show("length after normalize", attitude.norm().sqrt(), 1.0) > 0.001, "the behaviour changed");
    }
}
RUST
cargo run --quiet --release
