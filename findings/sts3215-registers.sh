#!/bin/sh
# sts3215 0.0.2, st3215 0.0.2 (crates.io): the crate sts3215 has other registers than the servo, and than the crate st3215. enable_torque() writes 1 to address 48, the low byte of the torque limit, and disable_torque()
# writes 0 there: the torque is not switched on, and the limit of 1000 (1000 is all of it) becomes 769, then 768. A position with a speed writes the speed to the goal time and the acceleration to the goal speed.
# read_current() reads two other bytes. And a correct answer is refused (ChecksumMismatch) when its bytes happen to have one of 256 sums: servo 1 can't be read at position 245. There is no other error.
# Seen on 2026-11-29:  enable_torque 48; st3215: TorqueSwitch 40, TorqueLimit 48   position 2048, speed 300, acceleration 50 reach RunningTime 300 and RunningSpeed 50
#                      read_current 67, CurrentCurrent 69   position 245: ChecksumMismatch, 244 and 246 are read
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "servo"
version = "0.0.0"
edition = "2024"

[dependencies]
embedded-io = "=0.6.1"
st3215 = "=0.0.2"
sts3215 = { version = "=0.0.2", default-features = false }
TOML
cat > src/main.rs <<'RS'
use embedded_io::{ErrorType, Read, Write};
use st3215::registers::Register;

/// A servo with the identity 1: a memory of 256 bytes, which answers reads and writes.
struct Servo {
    memory: [u8; 256],
    last: [u8; 2],
    answer: Vec<u8>,
}

impl ErrorType for Servo {
    type Error = std::convert::Infallible;
}

impl Write for Servo {
    fn write(&mut self, frame: &[u8]) -> Result<usize, Self::Error> {
        let (end, address) = (3 + usize::from(frame[3]), usize::from(frame[5]));
        let data = match frame[4] {
            2 => self.memory[address..address + usize::from(frame[6])].to_vec(),
            _ => {
                self.memory[address..address + end - 6].copy_from_slice(&frame[6..end]);
                Vec::new()
            }
        };
        self.last = [frame[4], frame[5]];
        self.answer = [&[0xff, 0xff, 1, data.len() as u8 + 2, 0], &data[..]].concat();
        self.answer.push(!self.answer[2..].iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte)));
        Ok(frame.len())
    }
    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl Read for Servo {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        buffer[..self.answer.len()].copy_from_slice(&self.answer);
        Ok(self.answer.len())
    }
}

fn main() {
    let (mut servo, mut buffer) = (Servo { memory: [0; 256], last: [0; 2], answer: Vec::new() }, [0; 64]);
    let word = |servo: &Servo, register: Register| u16::from_le_bytes([servo.memory[register as usize], servo.memory[register as usize + 1]]);
    servo.memory[Register::TorqueLimit as usize..][..2].copy_from_slice(&1000u16.to_le_bytes());
    sts3215::enable_torque(&mut servo, &mut buffer, 1).unwrap();
    println!("enable_torque writes {}: TorqueSwitch is {}, TorqueLimit {}", servo.last[1], servo.memory[Register::TorqueSwitch as usize], word(&servo, Register::TorqueLimit));
    assert!(servo.last[1] == 48 && servo.memory[Register::TorqueSwitch as usize] == 0 && word(&servo, Register::TorqueLimit) == 769);
    sts3215::disable_torque(&mut servo, &mut buffer, 1).unwrap();
    assert_eq!(word(&servo, Register::TorqueLimit), 768);

    sts3215::move_to_position(&mut servo, &mut buffer, 1, 2048, Some(300), Some(50)).unwrap();
    let moved = [Register::TargetLocation, Register::RunningTime, Register::RunningSpeed].map(|register| (register, word(&servo, register)));
    println!("position 2048, speed 300, acceleration 50: {moved:?}");
    assert_eq!(moved.map(|(_, value)| value), [2048, 300, 50]);
    assert_eq!(servo.memory[Register::Acceleration as usize], 0);

    sts3215::read_current(&mut servo, &mut buffer, 1).unwrap();
    println!("read_current reads {}, CurrentCurrent is at {}", servo.last[1], Register::CurrentCurrent as usize);
    assert!(servo.last == [2, 67] && Register::CurrentCurrent as usize == 69);

    for position in [244u16, 245, 246] {
        servo.memory[Register::CurrentLocation as usize..][..2].copy_from_slice(&position.to_le_bytes());
        let read = sts3215::read_position(&mut servo, &mut buffer, 1);
        println!("position {position}: {read:?}");
        assert!(if position == 245 { matches!(read, Err(sts3215::ServoError::ChecksumMismatch(..))) } else { read.is_ok_and(|read| read == position) });
    }
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
