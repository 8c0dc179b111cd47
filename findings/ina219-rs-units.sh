#!/bin/sh
# ina219_rs 0.5.1 (crates.io, INA219 current sensor): the readings are the register's counts with the unit of a milliampere, whatever was calibrated.
# current() multiplies by 1 mA where the count is the largest current of Opts / 32768: with the default of 1 A it is 33 times too high, 1.750 A for
# 53.4 mA, and a motor's current limit by it trips at 3 percent. power() takes 1 mW for 0.61 mW, and shunt_voltage() 1 uV for the chip's 10 uV. The
# numbers do not fit each other either: 1.750 A at 8.228 V would be 14 W. Only voltage() is right. The output in the README shows the same. There is
# no error.
# Seen on 2026-11-30:  chip with 5.34 mV at 0.1 ohm, 8.228 V, that is 53.4 mA and 0.44 W: current 1.749A, shunt 534 uV, power 719mW, voltage 8.228V
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "units"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-hal = "=0.2.7"
ina219_rs = { version = "=0.5.1", features = ["ina219"] }
TOML
cat > src/main.rs <<'RS'
use embedded_hal::blocking::i2c::{Read, Write};
use ina219_rs::{ina219::{Opts, INA219}, physic};
use std::convert::Infallible;

/// An INA219 with 0.1 ohm: its registers by the formulas of the data sheet.
#[derive(Default)]
struct Chip {
    calibration: u64,
    pointer: u8,
}

/// 5.34 mV in steps of 10 uV, and 8.228 V in steps of 4 mV.
const SHUNT: u64 = 534;
const BUS: u64 = 2057;

impl Write for Chip {
    type Error = Infallible;
    fn write(&mut self, _: u8, bytes: &[u8]) -> Result<(), Infallible> {
        self.pointer = bytes[0];
        if bytes.len() == 3 && bytes[0] == 5 {
            self.calibration = u64::from(u16::from_be_bytes([bytes[1], bytes[2]]));
        }
        Ok(())
    }
}

impl Read for Chip {
    type Error = Infallible;
    fn read(&mut self, _: u8, buffer: &mut [u8]) -> Result<(), Infallible> {
        let current = SHUNT * self.calibration / 4096;
        let value = match self.pointer {
            1 => SHUNT,
            2 => BUS << 3,
            3 => current * BUS / 5000,
            4 => current,
            _ => 0,
        };
        buffer.copy_from_slice(&(value as u16).to_be_bytes());
        Ok(())
    }
}

fn main() {
    let mut sensor = INA219::new(Chip::default(), Opts::new(0x40, 100 * physic::MilliOhm, physic::Ampere));
    sensor.init().unwrap();
    let (current, shunt) = (sensor.current().unwrap(), sensor.shunt_voltage().unwrap());
    let (power, voltage) = (sensor.power().unwrap(), sensor.voltage().unwrap());
    let counts = sensor.current_raw().unwrap();
    println!("SEEN 53.4 mA through 0.1 ohm at 8.228 V: current {current}, shunt {shunt}, power {power}, voltage {voltage}");
    println!("SEEN current by the count {counts} of 1 A / 32768: {:.1} mA", f64::from(counts) * 1000.0 / 32768.0);
    assert!((f64::from(counts) / 32.768 - 53.4).abs() < 0.2);
    assert!(current.starts_with("1.7") && current.ends_with('A') && !current.ends_with("mA"));
    assert!(shunt.starts_with("534") && power.starts_with("7") && power.ends_with("mW") && voltage == "8.228V");
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
