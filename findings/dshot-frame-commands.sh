#!/bin/sh
# dshot-frame 0.4.0 (crates.io, DShot, the digital protocol of motor controllers): two commands are exchanged: Command::ThreeDModeOn is 9 and Command::ThreeDModeOff is 10, where the protocol has 9 for off and 10 for on. A motor that was
# to turn in one direction is reversible after ThreeDModeOff and SettingsSave, for good: half of the throttle's range turns it backward. The telemetry of a motor at rest, whose 12 bits are all ones by the protocol, is
# a speed of 917 per minute (stopped is 0 in the period only). And the temperature, voltage and current that a controller sends after ExtendedTelemetryEnable are taken for speeds: 40 degrees are 750,000. There is no error: the
# checksums are right.
# Seen on 2026-11-30:  ThreeDModeOn: 9 (10)   ThreeDModeOff: 10 (9)   at rest (0xfff): 917 per minute (0)   a temperature of 40 degrees (0x228): 750000   a period of 1,000 us: 60000
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "commands"
version = "0.0.0"
edition = "2021"

[dependencies]
dshot-frame = "=0.4.0"
TOML
cat > src/main.rs <<'RS'
use dshot_frame::{Command, ErpmTelemetry, NormalFrame};

/// The number of a command in its frame.
fn number(command: Command) -> u16 {
    NormalFrame::command(command, true).inner() >> 5
}

/// The electrical speed of a telemetry frame of 12 bits with its checksum.
fn speed(payload: u16) -> u32 {
    let crc = (payload ^ (payload >> 4) ^ (payload >> 8)) & 15;
    ErpmTelemetry::try_from_raw(payload << 4 | crc).unwrap().erpm()
}

fn main() {
    // The commands around them have the protocol's numbers.
    assert_eq!([number(Command::SpinDirection1), number(Command::SpinDirection2), number(Command::SettingsSave), number(Command::SpinDirectionReversed)], [7, 8, 12, 21]);
    let (on, off) = (number(Command::ThreeDModeOn), number(Command::ThreeDModeOff));
    // 1,000 us as 500 shifted by 1, with the upper bit of the base set, as a controller sends it.
    let (turning, rest, temperature) = (speed(1 << 9 | 500), speed(0xFFF), speed(0x2 << 8 | 40));
    println!("SEEN ThreeDModeOn {on}, ThreeDModeOff {off}; 1000 us: {turning}, at rest: {rest}, temperature of 40 degrees: {temperature}");
    assert_eq!((on, off), (9, 10));
    assert_eq!((turning, rest, temperature), (60_000, 917, 750_000));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
