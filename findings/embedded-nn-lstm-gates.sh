#!/bin/sh
# embedded-nn 0.2.3: no gate of its LSTM is below one half. sigmoid_s16 gives 0 to 32767 for 0 to 1, and lstm_step_s8_s16 reads that as -32768 to 32767:
# a gate of 0 acts as 0.5. A cell whose forget and input gates are closed should lose its value within a step; it keeps half of it.
# Seen on 2026-11-29:  gate 11 of 32767, cell 16000 -> 8002, expected 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > Cargo.toml <<'TOML'
[package]
name = "gates"
version = "0.0.0"
edition = "2024"
[[bin]]
name = "gates"
path = "main.rs"
[dependencies]
embedded-nn = "=0.2.3"
TOML
cat > main.rs <<'RS'
use embedded_nn::activations::sigmoid_s16;
use embedded_nn::{Activation, LstmGateParams, PerTensorQuantParams, lstm_step_s8_s16};

fn main() {
    // One unit whose weights are 0. Multiplier and shift mean 1, so that gates are sigmoids of the biases, which are i16: i and f closed.
    let bias = [-32768, -32768, 0, 0];
    let mut closed = [0];
    sigmoid_s16(&[-32768], &mut closed, 0);
    let gates = LstmGateParams { input_offset: 0, hidden_offset: 0, multiplier: 1 << 30, shift: 1 };
    let (mut hidden, mut cell) = ([0], [16000]);
    let output = PerTensorQuantParams::new(1 << 30, -7);
    let all = Activation::int8_unconstrained();
    lstm_step_s8_s16(&[0], &mut hidden, &mut cell, &[0; 4], &[0; 4], &bias, &gates, 32767, &output, 0, &all).unwrap();
    println!("gate {} of 32767, cell 16000 -> {}, expected 0", closed[0], cell[0]);
    assert!(closed[0] < 100 && (7900..8100).contains(&cell[0]));
}
RS
cargo run --quiet
