#!/bin/sh
# robstride 0.3.6 (crates.io): the crate does not read back the commands that it writes. denormalize_value(), by which from_control_command() and from_command() decode, cancels its own scale and is an offset only. A command of all zeros for
# a RobStride 03 is decoded as -87 rad, -80 rad/s and -40 Nm; a kp of 50 as 1; and from the frame's bytes, an angle of 8 % is 35475 %. There is no error. What is sent to a motor, and a motor's feedback, are scaled by another
# function and are right: it is a simulated motor, a recorder of commands or a test of a limit that sees these numbers.
# Seen on 2026-11-30:  0 rad, 0 rad/s, 0 Nm -> -87.4 rad, -80 rad/s, -40 Nm   1 rad, kp 50 -> -79.5 rad, kp 1   angle of 8.0 % on the bus -> 35475 %
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "decoding"
version = "0.0.0"
edition = "2021"

[dependencies]
robstride = "=0.3.6"
TOML
cat > src/main.rs <<'RS'
use robstride::robstride03::RobStride03Command;
use robstride::{CommandData, ControlCommand, TypedCommandData};

fn main() {
    let near = |a: f32, b: f32| (a - b).abs() < 0.05;
    let command = |angle: f32, kp: f32| RobStride03Command { target_angle_rad: angle, kp, ..Default::default() };
    let decoded = |angle, kp| RobStride03Command::from_control_command(command(angle, kp).to_control_command());
    let (zero, one) = (decoded(0.0, 0.0), decoded(1.0, 50.0));
    println!("SEEN zeros: {:.1} rad, {:.0} rad/s, {:.0} Nm   1 rad, kp 50: {:.1} rad, kp {}", zero.target_angle_rad, zero.target_velocity_rads, zero.torque_nm, one.target_angle_rad, one.kp);
    assert!(near(zero.target_angle_rad, -87.43) && near(zero.target_velocity_rads, -80.0) && near(zero.torque_nm, -40.0));
    assert!(near(one.target_angle_rad, -79.48) && near(one.kp, 1.0));

    let sent = command(1.0, 50.0).to_control_command();
    let angle = sent.target_angle;
    let frame = sent.to_command(1);
    let code = u16::from_be_bytes([frame.data[0], frame.data[1]]);
    let read = ControlCommand::from_command(frame);
    println!("SEEN angle of {angle:.1} % is code {code}, read back {:.0} %", read.target_angle);
    assert!(near(angle, 7.96) && code == 35_375 && near(read.target_angle, 35_475.0));
}
RS
cargo run --release -q -j1 2>err.txt || { tail -n 20 err.txt; exit 1; }
