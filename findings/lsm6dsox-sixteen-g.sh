#!/bin/sh
# lsm6dsox 2.1.0 (crates.io): of the accelerometer's four ranges, that of 16 g has a wrong factor, 0.6714 mg for a code, where the sensor has 0.488 mg: gravity is 1.38 g, and the range ends at 22 g. Its documentation says that the largest code of that
# range is 16 g. The other three ranges are right, and so are the raw values: a policy that was trained or calibrated in one range observes 38 % more in the other, and a filter that takes the accelerometer for gravity only where its length is
# near 1 g never does. There is no error.
# Seen on 2026-11-30:  flat, 1 g along z: Accel2g 0.999   Accel4g 0.999   Accel8g 0.999   Accel16g 1.375   largest code of Accel16g: 22.0 g
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "gravity"
version = "0.0.0"
edition = "2021"

[dependencies]
lsm6dsox = "=2.1.0"
accelerometer = "=0.12.0"
embedded-hal = "=1.0.0"
TOML
cat > src/main.rs <<'RS'
use accelerometer::Accelerometer;
use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorType, I2c, Operation};
use lsm6dsox::{AccelerometerScale, Lsm6dsox, SlaveAddress};
use std::convert::Infallible;

const WHO_AM_I: usize = 0x0F;
const CTRL1_XL: usize = 0x10;
const STATUS: usize = 0x1E;
const OUTZ_L_A: usize = 0x2C;

/// The registers of a sensor that measures a multiple of its largest code along z, or 1 g.
struct Sensor {
    memory: [u8; 256],
    full: bool,
}

impl ErrorType for Sensor {
    type Error = Infallible;
}

impl I2c for Sensor {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
        let range = [2.0, 16.0, 4.0, 8.0][usize::from(self.memory[CTRL1_XL] >> 2 & 3)];
        let code = if self.full { i16::MAX } else { (32768.0 / range) as i16 };
        self.memory[OUTZ_L_A..OUTZ_L_A + 2].copy_from_slice(&code.to_le_bytes());
        let mut at = 0;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => {
                    at = usize::from(bytes[0]);
                    self.memory[at..at + bytes.len() - 1].copy_from_slice(&bytes[1..]);
                }
                Operation::Read(into) => {
                    let count = into.len();
                    into.copy_from_slice(&self.memory[at..at + count]);
                }
            }
        }
        Ok(())
    }
}

struct Wait;

impl DelayNs for Wait {
    fn delay_ns(&mut self, _: u32) {}
}

fn measured(scale: AccelerometerScale, full: bool) -> f32 {
    let mut memory = [0; 256];
    (memory[WHO_AM_I], memory[STATUS]) = (0x6C, 1);
    let mut sensor = Lsm6dsox::new(Sensor { memory, full }, SlaveAddress::Low, Wait);
    sensor.set_accel_scale(scale).unwrap();
    sensor.accel_norm().unwrap().z
}

fn main() {
    use AccelerometerScale::{Accel16g, Accel2g, Accel4g, Accel8g};
    let seen = [Accel2g, Accel4g, Accel8g, Accel16g].map(|scale| measured(scale, false));
    let largest = [Accel8g, Accel16g].map(|scale| measured(scale, true));
    println!("SEEN 1 g at 2, 4, 8, 16 g: {seen:.3?}; largest code at 8 and 16 g: {largest:.1?}");
    assert!(seen[..3].iter().all(|value| (value - 1.0).abs() < 0.001) && (seen[3] - 1.375).abs() < 0.002);
    assert!((largest[0] - 8.0).abs() < 0.01 && (largest[1] - 22.0).abs() < 0.01);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
