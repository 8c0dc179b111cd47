#!/bin/sh
# ina260 0.3.1 (crates.io, current and power monitor of a motor's supply): the split readings. power_split() keeps the watts in 8 bits: 300 W are 44
# W, where the sensor measures up to 540 W. The rest of current_split() and voltage_split(), "tenth millivolts" by the documentation, counts
# hundredths: 12.5 V are (12, 50000), which by the documentation are 17 V. The rest of power_split() has the same text, and counts 10 uW. Of a
# negative current, only the whole amperes have a sign: -0.5 A are (0, 50000), as +0.5 A, and -1.5 A are (-1, 50000), which add up to -0.5. current(),
# voltage() and power() are right. There is no error.
# Seen on 2026-11-30:  300 W: (44, 0), power() 300000   12.5 V: (12, 50000)   0.5 A and -0.5 A: (0, 50000) both   -1.5 A: (-1, 50000), current()
# -1500000
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "split"
version = "0.0.0"
edition = "2021"

[dependencies]
ina260 = "=0.3.1"
embedded-hal = "=0.2.7"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::blocking::i2c::{Write, WriteRead};
use ina260::INA260;
use std::convert::Infallible;

/// The sensor's registers: 1.25 mA, 1.25 mV and 10 mW.
struct Chip {
    amperes: f64,
    volts: f64,
}

impl Write for Chip {
    type Error = Infallible;
    fn write(&mut self, _: u8, _: &[u8]) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteRead for Chip {
    type Error = Infallible;
    fn write_read(&mut self, _: u8, bytes: &[u8], buffer: &mut [u8]) -> Result<(), Infallible> {
        let word = match bytes[0] {
            1 => (self.amperes / 1.25e-3).round() as i16 as u16,
            2 => (self.volts / 1.25e-3).round() as u16,
            3 => (self.amperes.abs() * self.volts / 10e-3).round() as u16,
            _ => 0,
        };
        buffer.copy_from_slice(&word.to_be_bytes());
        Ok(())
    }
}

fn main() {
    let sensor = |amperes, volts| INA260::new(Chip { amperes, volts }, 0x40).unwrap();
    let mut strong = sensor(12.5, 24.0);
    let (watts, power) = (strong.power_split().unwrap(), strong.power().unwrap());
    println!("SEEN 300 W: {watts:?}, power() {power} mW");
    let mut battery = sensor(1.0, 12.5);
    let (volts, voltage) = (battery.voltage_split().unwrap(), battery.voltage().unwrap());
    println!("SEEN 12.5 V: {volts:?}, voltage() {voltage} uV");
    let amperes: Vec<_> = [0.5, -0.5, 1.5, -1.5]
        .iter()
        .map(|&current| (current, sensor(current, 12.0).current_split().unwrap(), sensor(current, 12.0).current().unwrap()))
        .collect();
    println!("SEEN currents (A), split, current() in uA: {amperes:?}");
    assert!(watts == (44, 0) && power == 300_000 && volts == (12, 50_000) && voltage == 12_500_000);
    assert!(amperes.iter().map(|seen| seen.1).eq([(0, 50_000), (0, 50_000), (1, 50_000), (-1, 50_000)]));
    assert!(amperes.iter().map(|seen| seen.2).eq([500_000, -500_000, 1_500_000, -1_500_000]));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
