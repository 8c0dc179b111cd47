#!/bin/sh
# ina226-tp 0.4.1 (crates.io, INA226, "Bi-Direcional Current and Power Monitor"): the current and the shunt voltage are read without their sign. A
# current of -1 A, of a motor that brakes, is 64.536 A, and -2.5 mV over the shunt is 161.34 mV: the smallest current back is the largest forward,
# which a limit takes for a short circuit and a sum of charge for a jump. And a bus that does not answer reads 0.0 A and 0.0 V: the error is dropped,
# commit() returns nothing, and a torn wire looks like a motor at rest. read_current() has no Result. There is no error.
# Seen on 2026-11-30:  -1.000 A read as 64.536, +1.000 A as 1.000   -2.5 mV read as 161.340 mV   bus without an answer: 0.0 A, 0.0 V
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "current"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-hal = "=1.0.0"
ina226-tp = "=0.4.1"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};
use ina226_tp::INA226;
use std::{cell::Cell, rc::Rc};

/// An INA226 whose current can be set, and whose wire can be torn.
#[derive(Clone, Default)]
struct Chip {
    counts: Rc<Cell<i16>>,
    torn: Rc<Cell<bool>>,
    pointer: u8,
}

impl ErrorType for Chip {
    type Error = ErrorKind;
}

impl I2c for Chip {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        if self.torn.get() {
            return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
        }
        for operation in operations {
            match operation {
                Operation::Write(bytes) => self.pointer = bytes[0],
                Operation::Read(buffer) => {
                    let value = match self.pointer {
                        0x01 | 0x04 => self.counts.get() as u16,
                        0x02 => 9600,
                        0xFE => 0x5449,
                        0xFF => 0x2260,
                        _ => 0,
                    };
                    buffer.copy_from_slice(&value.to_be_bytes());
                }
            }
        }
        Ok(())
    }
}

fn main() {
    let chip = Chip::default();
    let mut sensor: INA226<Chip> = INA226::new(None);
    sensor.set_ina_address(0x40);
    let mut sensor = sensor.initialize(chip.clone()).unwrap();
    sensor.set_current_lsb(0.001);
    let read = [1000, -1000].map(|counts| {
        chip.counts.set(counts);
        (sensor.read_current(), sensor.read_shunt_voltage() * 1000.0)
    });
    println!("SEEN +1 A and +2.5 mV: {:.3} A, {:.3} mV; -1 A and -2.5 mV: {:.3} A, {:.3} mV", read[0].0, read[0].1, read[1].0, read[1].1);
    assert!((read[0].0 - 1.0).abs() < 1e-9 && (read[1].0 - 64.536).abs() < 1e-9 && (read[1].1 - 161.34).abs() < 1e-6);
    chip.torn.set(true);
    let (current, voltage) = (sensor.read_current(), sensor.read_voltage());
    sensor.commit();
    println!("SEEN bus without an answer: {current:.1} A, {voltage:.1} V");
    assert_eq!((current, voltage), (0.0, 0.0));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
