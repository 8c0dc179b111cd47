#!/bin/sh
# mpu6050 0.1.6 (crates.io): the range of the accelerometer is kept twice, in the sensor and in the driver, and three ways leave another one than was asked for. new_with_sens(G8) does not set the sensor, which stays at 2 g: 0.5 g is
# read as 2 g. With init() after it, which the documentation asks for, both are at 2 g: the G8 is forgotten, and a leg's impact of 3 g is read as 2 g. And setup_motion_detection() writes the whole register for one bit of it: after
# set_accel_range(G8), all accelerations are four times as large from then on. There is no error. Madgwick and other filters take the direction only; a policy that sees the acceleration, or a fall detector, does not.
# Seen on 2026-11-30:  new_with_sens(G8): 0.5 g -> 2.0   and init(): 3 g -> 2.0   set_accel_range(G8): 3 g -> 3.0   and setup_motion_detection(): 0.5 g -> 2.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "ranges"
version = "0.0.0"
edition = "2021"

[dependencies]
mpu6050 = "=0.1.6"
embedded-hal = "=0.2.7"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::blocking::{delay::DelayMs, i2c::{Write, WriteRead}};
use mpu6050::{device::{AccelRange, GyroRange}, Mpu6050};
use std::cell::Cell;
use std::rc::Rc;

/// An MPU-6050: its registers, and an acceleration along z in g.
struct Sensor {
    registers: [u8; 256],
    g: Rc<Cell<f32>>,
}

impl Write for Sensor {
    type Error = ();
    fn write(&mut self, _: u8, bytes: &[u8]) -> Result<(), ()> {
        self.registers[usize::from(bytes[0])] = bytes[1];
        Ok(())
    }
}

impl WriteRead for Sensor {
    type Error = ();
    fn write_read(&mut self, _: u8, bytes: &[u8], answer: &mut [u8]) -> Result<(), ()> {
        // 16384 steps for 1 g at a range of 2 g, and half as many with each wider one (bits 3 and 4 of register 0x1C).
        let steps = self.g.get() * f32::from(16384_u16 >> (self.registers[0x1C] >> 3 & 3));
        self.registers[0x3F..0x41].copy_from_slice(&(steps as i16).to_be_bytes());
        let start = usize::from(bytes[0]);
        answer.copy_from_slice(&self.registers[start..start + answer.len()]);
        Ok(())
    }
}

struct Wait;

impl DelayMs<u8> for Wait {
    fn delay_ms(&mut self, _: u8) {}
}

fn main() {
    let g = Rc::new(Cell::new(0.0));
    let sensor = || {
        let mut registers = [0; 256];
        registers[0x75] = 0x68;
        Sensor { registers, g: g.clone() }
    };
    let read = |driver: &mut Mpu6050<Sensor>, of: f32| {
        g.set(of);
        driver.get_acc().unwrap().z
    };
    let near = |a: f32, b: f32| (a - b).abs() < 0.001;

    let mut driver = Mpu6050::new_with_sens(sensor(), AccelRange::G8, GyroRange::D250);
    let small = read(&mut driver, 0.5);
    driver.init(&mut Wait).unwrap();
    let large = read(&mut driver, 3.0);
    println!("SEEN new_with_sens(G8): 0.5 g -> {small:.2}   and init(): 3 g -> {large:.2}, range {:?}", driver.get_accel_range().unwrap());
    assert!(near(small, 2.0) && near(large, 2.0));

    driver.set_accel_range(AccelRange::G8).unwrap();
    let before = read(&mut driver, 3.0);
    driver.setup_motion_detection().unwrap();
    let after = read(&mut driver, 0.5);
    println!("SEEN set_accel_range(G8): 3 g -> {before:.2}   and setup_motion_detection(): 0.5 g -> {after:.2}, range {:?}", driver.get_accel_range().unwrap());
    assert!(near(before, 3.0) && near(after, 2.0));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
