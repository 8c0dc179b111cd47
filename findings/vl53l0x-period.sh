#!/bin/sh
# vl53l0x 0.3.1 (crates.io, time-of-flight distance sensor): start_continuous() with a period writes its four bytes in the wrong order. The sensor's
# registers begin with the highest byte, as in the crate's own writes of two bytes; the period's write begins with the lowest. With a clock that is
# calibrated to 1,000 counts per ms, 50 ms become 1,354,956 ms: the sensor measures each 22 minutes, and the reader sees a distance once or never. 100
# ms become 2,693,136 ms. A period of 0, measuring without a break, is right. There is no error.
# Seen on 2026-11-30:  50 ms: bytes 50 c3 00 00, which the sensor takes for 1354956 ms   100 ms: 2693136 ms   1000 ms: 1078071 ms
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "period"
version = "0.0.0"
edition = "2021"

[dependencies]
vl53l0x = "=0.3.1"
embedded-hal = "=0.2.7"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::blocking::i2c::{Write, WriteRead};
use std::cell::RefCell;
use std::convert::Infallible;
use vl53l0x::VL53L0x;

const PERIOD: u8 = 0x04; // SYSTEM_INTERMEASUREMENT_PERIOD
const COUNTS: u16 = 1000; // OSC_CALIBRATE_VAL: counts of the clock per ms

/// The sensor's registers, ready at once, and the last period that was written.
struct Chip<'a>(&'a RefCell<Vec<u8>>, [u8; 256]);

impl Write for Chip<'_> {
    type Error = Infallible;
    fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Infallible> {
        self.write_read(address, bytes, &mut [])
    }
}

impl WriteRead for Chip<'_> {
    type Error = Infallible;
    fn write_read(&mut self, _: u8, bytes: &[u8], buffer: &mut [u8]) -> Result<(), Infallible> {
        let first = usize::from(bytes[0]);
        for (index, byte) in bytes[1..].iter().enumerate() {
            self.1[first + index] = *byte;
        }
        if bytes[0] == PERIOD && bytes.len() == 5 {
            *self.0.borrow_mut() = bytes[1..].to_vec();
        }
        for (index, byte) in buffer.iter_mut().enumerate() {
            *byte = match first + index {
                0xC0 => 0xEE,     // the model
                0x83 => 1,        // the reference SPADs are read
                0x92 => 5,        // their number
                0x13 => 7,        // a measurement is ready
                0x50 | 0x70 => 6, // VCSEL periods
                0x51 | 0x71 => 1, // timeouts of the ranges
                0x52 => 0x96,
                0x72 => 0xFE,
                0xF8 => (COUNTS >> 8) as u8,
                0xF9 => COUNTS as u8,
                other => self.1[other],
            };
        }
        Ok(())
    }
}

fn main() {
    let written = RefCell::new(Vec::new());
    let mut sensor = VL53L0x::new(Chip(&written, [0; 256])).unwrap();
    let mut seen = Vec::new();
    for period in [50, 100, 1000] {
        sensor.start_continuous(period).unwrap();
        let bytes: [u8; 4] = written.borrow().clone().try_into().unwrap();
        // The highest byte comes first, data sheet.
        let taken = u32::from_be_bytes(bytes) / u32::from(COUNTS);
        println!(
            "SEEN {period} ms: bytes {bytes:02x?}, {taken} ms for the sensor ({} in the other order)",
            u32::from_le_bytes(bytes) / u32::from(COUNTS)
        );
        assert_eq!(u32::from_le_bytes(bytes), period * u32::from(COUNTS));
        seen.push(taken);
    }
    assert!(seen[0] == 1_354_956 && seen.iter().all(|&taken| taken > 1_000_000));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
