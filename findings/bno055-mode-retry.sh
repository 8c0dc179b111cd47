#!/bin/sh
# bno055 0.4.0 (crates.io, attitude sensor): set_mode() takes the mode for set before it is, so that a second try does nothing. The driver keeps the
# mode for itself, notes the new one before it writes the register, and does not write it if the mode is already noted. After one error of the I2C bus
# set_mode(NDOF) returns the error, the retry returns Ok without a transfer, and the sensor stays in its configuration mode, where it measures
# nothing. quaternion() refuses to work in a mode without fusion, but asks the driver's note: it returns Ok with [0, 0, 0, 0], as euler_angles()
# returns level. soft_reset(), a public method, does the same: the sensor is in its configuration mode after it, the note says NDOF, and
# set_mode(NDOF) sends nothing. Only get_mode(), which reads the register, or another mode in between helps. Resets and retries are for bad times.
# Seen on 2026-12-01:  NDOF with one bus error: Err, retry Ok, mode of the sensor 0, quaternion Ok 0, 0, 0, 0   after soft_reset() and NDOF: mode 0,
#                      the same
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "retry"
version = "0.0.0"
edition = "2021"

[dependencies]
bno055 = "=0.4.0"
embedded-hal = "=1.0.0"
TOML
cat > src/main.rs <<'RS'
use bno055::{BNO055OperationMode as Mode, Bno055};
use embedded_hal::{delay::DelayNs, i2c};
use std::{cell::RefCell, rc::Rc};

const MODE: usize = 0x3D;
const TRIGGER: usize = 0x3F;

/// A sensor with one page of registers, which has a quaternion in its modes with fusion only.
struct Chip {
    registers: [u8; 128],
    fail_mode: bool,
    mode_writes: usize,
}

#[derive(Clone)]
struct Bus(Rc<RefCell<Chip>>);

impl i2c::ErrorType for Bus {
    type Error = i2c::ErrorKind;
}

impl i2c::I2c for Bus {
    fn transaction(&mut self, _: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), i2c::ErrorKind> {
        let mut chip = self.0.borrow_mut();
        let mut address = 0;
        for operation in operations {
            match operation {
                i2c::Operation::Write(bytes) => {
                    address = usize::from(bytes[0]);
                    for (place, byte) in bytes[1..].iter().enumerate() {
                        if address + place == MODE && std::mem::take(&mut chip.fail_mode) {
                            return Err(i2c::ErrorKind::Bus);
                        }
                        chip.mode_writes += usize::from(address + place == MODE);
                        chip.registers[address + place] = *byte;
                    }
                    if chip.registers[TRIGGER] & 0x20 != 0 {
                        chip.registers[TRIGGER] = 0;
                        chip.registers[MODE] = 0;
                    }
                }
                i2c::Operation::Read(to) => {
                    let real = if chip.registers[MODE] >= 8 { 16384_i16 } else { 0 };
                    chip.registers[0x20..0x22].copy_from_slice(&real.to_le_bytes());
                    to.copy_from_slice(&chip.registers[address..address + to.len()]);
                }
            }
        }
        Ok(())
    }
}

struct None;

impl DelayNs for None {
    fn delay_ns(&mut self, _: u32) {}
}

fn sensor() -> (Bno055<Bus>, Rc<RefCell<Chip>>) {
    let mut registers = [0; 128];
    registers[0] = 0xA0;
    let chip = Rc::new(RefCell::new(Chip { registers, fail_mode: false, mode_writes: 0 }));
    let mut sensor = Bno055::new(Bus(chip.clone()));
    sensor.init(&mut None).unwrap();
    (sensor, chip)
}

fn main() {
    let (mut good, chip) = sensor();
    good.set_mode(Mode::NDOF, &mut None).unwrap();
    let quaternion = good.quaternion().unwrap();
    println!("SEEN without an error: mode of the sensor {:#x}, quaternion's real part {}", chip.borrow().registers[MODE], quaternion.s);
    assert_eq!((chip.borrow().registers[MODE], quaternion.s), (0x0C, 1.0));

    let before = chip.borrow().mode_writes;
    good.soft_reset(&mut None).unwrap();
    good.set_mode(Mode::NDOF, &mut None).unwrap();
    let quaternion = good.quaternion().unwrap();
    let (mode, writes) = (chip.borrow().registers[MODE], chip.borrow().mode_writes - before);
    println!("SEEN after soft_reset() and set_mode(NDOF): mode {mode:#x}, written {writes} times, quaternion Ok, real part {}", quaternion.s);
    assert_eq!((mode, writes, quaternion.s), (0, 0, 0.0));

    let (mut bad, chip) = sensor();
    chip.borrow_mut().fail_mode = true;
    let (first, second) = (bad.set_mode(Mode::NDOF, &mut None).is_ok(), bad.set_mode(Mode::NDOF, &mut None).is_ok());
    let quaternion = bad.quaternion().unwrap();
    let mode = chip.borrow().registers[MODE];
    println!("SEEN set_mode(NDOF) with a bus error: Ok {first}, again: Ok {second}, mode {mode:#x}, quaternion Ok, real part {}", quaternion.s);
    assert_eq!((first, second, mode, quaternion.s), (false, true, 0, 0.0));
    bad.get_mode().unwrap();
    bad.set_mode(Mode::NDOF, &mut None).unwrap();
    println!("SEEN after get_mode() and set_mode(NDOF): mode {:#x}", chip.borrow().registers[MODE]);
    assert_eq!(chip.borrow().registers[MODE], 0x0C);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
