#!/bin/sh
# mt6701 0.2.5 (crates.io), a driver of the magnetic encoder MT6701: it counts a turn where the angle jumps by more than 0.8 of a turn between two updates, and not from half a turn. A shaft that passes zero with more than 0.2 turns per
# update loses that turn, and the position goes back by the rest: at 0.3 turns per update, 15 turns are counted as 0 (at 0.15 as 15), and the velocity is -70 turns/s in between. A first reading above 0.8 of a turn counts as a
# turn backward, so that a joint that rests at 5.5 rad starts at -0.78, and one at 4.9 at 4.9. get_position() is an f64 that is computed in f32: after 10,000 turns its steps are ten codes of the encoder.
# There is no error.
# Seen on 2026-11-30:  15 turns at 0.15 turns per update: 15.00   at 0.3: 0.00, velocity -70 to 30 turns/s (30)   start at 5.5 rad: -0.78, at 4.9: 4.90   after 10,000 turns: 11 places of 100 codes
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "turns"
version = "0.0.0"
edition = "2021"

[dependencies]
mt6701 = "=0.2.5"
embedded-hal = "=0.2.7"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::blocking::spi::Transfer;
use embedded_hal::digital::v2::OutputPin;
use mt6701::{AngleSensorTrait, MT6701Spi};
use std::cell::Cell;
use std::convert::Infallible;
use std::f64::consts::TAU;

/// The encoder, with its code of 14 bits in the upper part of the word.
struct Encoder<'a>(&'a Cell<u16>);
struct Select;

impl Transfer<u16> for Encoder<'_> {
    type Error = Infallible;
    fn transfer<'w>(&mut self, words: &'w mut [u16]) -> Result<&'w [u16], Infallible> {
        words[0] = self.0.get() << 1;
        Ok(words)
    }
}

impl OutputPin for Select {
    type Error = Infallible;
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// The positions (turns) and velocities (turns/s) of a shaft that turns by `step` per update, each 0.01 s.
fn turn(step: f64, updates: u64) -> Vec<(f64, f64)> {
    let code = Cell::new(0);
    let mut sensor = MT6701Spi::new(Encoder(&code), Select);
    (0..updates)
        .map(|update| {
            code.set(((update as f64 * step).fract() * 16384.0).round() as u16 % 16384);
            sensor.update((update + 1) * 10_000).unwrap();
            (sensor.get_position() / TAU, f64::from(sensor.get_velocity()) / TAU)
        })
        .collect()
}

/// The first position of a shaft that rests at an angle (rad).
fn start(angle: f64) -> f64 {
    let code = Cell::new((angle / TAU * 16384.0) as u16);
    let mut sensor = MT6701Spi::new(Encoder(&code), Select);
    sensor.update(10_000).unwrap();
    sensor.get_position()
}

fn main() {
    let slow = turn(0.15, 101);
    let fast = turn(0.3, 51);
    let (slow_end, fast_end) = (slow.last().unwrap().0, fast.last().unwrap().0);
    let velocities = fast[1..].iter().map(|seen| seen.1);
    let (least, most) = (velocities.clone().fold(f64::MAX, f64::min), velocities.fold(f64::MIN, f64::max));
    let (above, below) = (start(5.5), start(4.9));

    // 10,000 turns, then one code of the encoder after the other.
    let code = Cell::new(0);
    let mut sensor = MT6701Spi::new(Encoder(&code), Select);
    for update in 0..100_001u64 {
        code.set((update % 10) as u16 * 1638);
        sensor.update(update + 1).unwrap();
    }
    let turns = sensor.get_turns();
    let mut positions: Vec<f64> = (1..=100).map(|next| {
        code.set(next);
        sensor.update(200_000 + u64::from(next)).unwrap();
        sensor.get_position()
    }).collect();
    positions.dedup();
    println!("SEEN 0.15 turns per update: {slow_end:.2} of 15; 0.3: {fast_end:.2} of 15, velocity {least:.0} to {most:.0} turns/s (30); start {above:.2}, {below:.2}; {turns} turns: {} places of 100 codes", positions.len());
    assert!((slow_end - 15.0).abs() < 0.01 && fast_end < 1.0 && least < -60.0 && (most - 30.0).abs() < 0.1);
    assert!((above + 0.78).abs() < 0.01 && (below - 4.9).abs() < 0.01);
    assert!(turns >= 9_999 && positions.len() < 20);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
