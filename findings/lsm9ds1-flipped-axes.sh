#!/bin/sh
# lsm9ds1 0.1.0 (crates.io, ST's inertial sensor of nine axes): the settings flip_x, flip_y and flip_z of the gyroscope, for a sensor that is mounted upside down, do nothing: begin_gyro() writes four registers, and not ORIENT_CFG_G (address 0x13 by the
# data sheet), for which the crate computes the value right and has the address. The rates keep the sensor's own signs: a body that turns by +90 degrees/s is read as -90, an observation whose sign tells a
# balancing policy to push the wrong way. There is no error.
# Seen on 2026-11-30:  flip_x and flip_z: orient_cfg_g() 0b00101000, registers written by begin_gyro(): 0x10, 0x11, 0x12, 0x1e   with and without the flips: the same bytes
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "flipped"
version = "0.0.0"
edition = "2021"

[dependencies]
lsm9ds1 = "=0.1.0"
TOML
cat > src/main.rs <<'RS'
use lsm9ds1::gyro::GyroSettings;
use lsm9ds1::interface::{Interface, Sensor};
use lsm9ds1::{register::AG, LSM9DS1Init};
use std::{cell::RefCell, rc::Rc};

/// Keeps what is written.
struct Bus(Rc<RefCell<Vec<(u8, u8)>>>);

impl Interface for Bus {
    type Error = ();
    fn write(&mut self, _: Sensor, address: u8, value: u8) -> Result<(), ()> {
        self.0.borrow_mut().push((address, value));
        Ok(())
    }
    fn read(&mut self, _: Sensor, _: u8, buffer: &mut [u8]) -> Result<(), ()> {
        buffer.fill(0);
        Ok(())
    }
}

fn written(gyro: GyroSettings) -> Vec<(u8, u8)> {
    let log = Rc::new(RefCell::new(Vec::new()));
    let mut sensor = LSM9DS1Init { gyro, ..Default::default() }.with_interface(Bus(log.clone()));
    sensor.begin_accel().unwrap();
    sensor.begin_gyro().unwrap();
    sensor.begin_mag().unwrap();
    let seen = log.borrow().clone();
    seen
}

fn main() {
    let flipped = || GyroSettings { flip_x: true, flip_z: true, ..Default::default() };
    let (plain, turned) = (written(GyroSettings::default()), written(flipped()));
    println!("SEEN orient_cfg_g() {:#010b} for {:#04x}; written with the flips: {turned:02x?}", flipped().orient_cfg_g(), AG::ORIENT_CFG_G.addr());
    assert_eq!(flipped().orient_cfg_g(), 1 << 5 | 1 << 3);
    assert_eq!(AG::ORIENT_CFG_G.addr(), 0x13);
    assert_eq!(plain, turned);
    assert!(turned.iter().all(|&(address, _)| address != 0x13));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
