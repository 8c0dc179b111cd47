#!/bin/sh
# embassy-time 0.5.1, fugit 0.6.0 (crates.io): with a clock of 32,768 Hz, as on nRF, embassy-time's from_hz(1000) and from_millis(1) are 33 ticks: a loop of 1 kHz runs at 993 Hz. The two ways to
# state a period round apart: from_hz to the nearest, from_micros up, so that 2 kHz is 2048 Hz in one and 1928 Hz in the other. There is no error. In fugit a conversion between units depends on its
# name: 1999 us are 2 ms by convert(), and 1 ms by as_millis(); a rate of 600 Hz becomes a period of 1666 us, cut off. Velocities that are differences of positions by the wanted period are off by as much.
# Seen on 2026-11-29:  from_hz, from_micros: 300 Hz 300.6, 297.9   1000 Hz 993.0, 993.0   2000 Hz 2048.0, 1927.5   4000 Hz 4096.0, 3640.9   fugit 1999 us: convert 2, as_millis 1   600 Hz: 1666 us
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "period"
version = "0.0.0"
edition = "2024"

[dependencies]
embassy-time = { version = "=0.5.1", features = ["tick-hz-32_768"] }
fugit = "=0.6.0"
TOML
cat > src/main.rs <<'RS'
use embassy_time::Duration;
use fugit::{HertzU32, MicrosDurationU32};

fn main() {
    let mut seen = Vec::new();
    for rate in [300, 1000, 2000, 4000] {
        let ticks = [Duration::from_hz(rate), Duration::from_micros(1_000_000 / rate)].map(|period| period.as_ticks());
        let [by_rate, by_period] = ticks.map(|ticks| 32_768.0 / ticks as f64);
        println!("{rate} Hz: from_hz {by_rate:.1} Hz, from_micros {by_period:.1} Hz");
        seen.push(ticks);
    }
    assert_eq!(seen, [[109, 110], [33, 33], [16, 17], [8, 9]]);
    assert_eq!(Duration::from_millis(1).as_ticks(), 33);

    let time = MicrosDurationU32::from_ticks(1999);
    let [converted, named] = [time.convert::<1, 1000>().as_ticks(), time.as_millis()];
    let period: MicrosDurationU32 = HertzU32::Hz(600).to_duration();
    println!("fugit: 1999 us are {converted} ms by convert, {named} ms by as_millis; 600 Hz are {} us", period.as_micros());
    assert!(converted == 2 && named == 1 && period.as_micros() == 1666);
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
