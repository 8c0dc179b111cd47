#!/bin/sh
# bno080 0.1.3 (crates.io, attitude sensor BNO080 and BNO085): the quaternion has no real part when a packet holds one rotation vector, the only
# report that the driver can switch on. It reads the real part only if more than 14 bytes of reports are left, and the accuracy only if more than 16,
# but a rotation vector has 14 in all (0x0E for report 0x05 in the sensor's own list, which stands in the package's tests). rotation_quaternion(),
# "normalized quaternion", is then [x, y, z, 0], and heading_accuracy() 0, the best. A robot that stands level and heads north has [0, 0, 0, 0]; one
# turned by 20 degrees has a norm of 0.17, and normalized it is a turn by 180 degrees. With a second report in the packet, the first one is read in
# full, and the second one, the newer, without it again. Until the first report it is [0, 0, 0, 0] too, with Ok. There is no error.
# Seen on 2026-12-01:  yaw 20 degrees alone: [0, 0, 0.174, 0], accuracy 0   level: [0, 0, 0, 0]   yaw 20, then 30 in one packet: [0, 0, 0.259, 0]
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "single"
version = "0.0.0"
edition = "2021"

[dependencies]
bno080 = "=0.1.3"
embedded-hal = "=0.2.7"
TOML
cat > src/main.rs <<'RS'
use bno080::{interface::I2cInterface, wrapper::BNO080};
use embedded_hal::blocking::{delay::DelayMs, i2c};
use std::{cell::RefCell, collections::VecDeque, rc::Rc};

/// A sensor that has packets: a read of the header alone leaves the packet, a longer one takes it.
#[derive(Clone, Default)]
struct Bus(Rc<RefCell<VecDeque<Vec<u8>>>>);

impl i2c::Read for Bus {
    type Error = ();
    fn read(&mut self, _: u8, to: &mut [u8]) -> Result<(), ()> {
        let mut packets = self.0.borrow_mut();
        let packet = packets.front().cloned().unwrap_or_default();
        let count = to.len().min(packet.len());
        to.fill(0);
        to[..count].copy_from_slice(&packet[..count]);
        if to.len() > 4 {
            packets.pop_front();
        }
        Ok(())
    }
}

impl i2c::Write for Bus {
    type Error = ();
    fn write(&mut self, _: u8, _: &[u8]) -> Result<(), ()> {
        Ok(())
    }
}

impl i2c::WriteRead for Bus {
    type Error = ();
    fn write_read(&mut self, _: u8, _: &[u8], _: &mut [u8]) -> Result<(), ()> {
        Err(())
    }
}

struct None;

impl DelayMs<u8> for None {
    fn delay_ms(&mut self, _: u8) {}
}

/// A packet of the channel of reports with a time stamp of five bytes and a rotation vector of 14 for each yaw, accurate to 0.5 rad.
fn packet(yaws: &[f64]) -> Vec<u8> {
    let mut bytes = vec![0, 0, 3, 0, 0xFB, 0, 0, 0, 0];
    for yaw in yaws {
        let half = yaw.to_radians() / 2.0;
        bytes.extend([0x05, 0, 3, 0]);
        for value in [0.0, 0.0, half.sin() * 16384.0, half.cos() * 16384.0, 0.5 * 4096.0] {
            bytes.extend((value.round() as i32).min(32767).to_le_bytes()[..2].iter());
        }
    }
    bytes[0] = bytes.len() as u8;
    bytes
}

fn read(yaws: &[f64]) -> ([f32; 4], f32) {
    let bus = Bus::default();
    bus.0.borrow_mut().push_back(packet(yaws));
    let mut sensor = BNO080::new_with_interface(I2cInterface::default(bus));
    assert_eq!(sensor.handle_one_message(&mut None, 10), 1);
    (sensor.rotation_quaternion().unwrap(), sensor.heading_accuracy())
}

fn main() {
    let (one, level, two) = (read(&[20.0]), read(&[0.0]), read(&[20.0, 30.0]));
    println!("SEEN yaw 20 alone: {:.3?}, accuracy {}   level: {:.3?}   yaw 20, then 30: {:.3?}, accuracy {}", one.0, one.1, level.0, two.0, two.1);
    let near = |seen: [f32; 4], right: [f32; 4]| seen.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(near(one.0, [0.0, 0.0, 0.1736, 0.0]) && one.1 == 0.0);
    assert!(near(level.0, [0.0; 4]));
    assert!(near(two.0, [0.0, 0.0, 0.2588, 0.0]) && two.1 == 0.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
