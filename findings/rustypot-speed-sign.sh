#!/bin/sh
# rustypot 1.13.1 (crates.io): the conversions of a DYNAMIXEL's speed, of the modules mx, ax and xl320, look for its direction in bit 11. The servos have it in bit 10 (0 to 1023 counterclockwise, 1024 to 2047 clockwise), where the same modules look for the
# direction of the load. Present speeds of both directions are read with one sign: 99 and 1024 + 99 are both -1.18 rad/s, as if a joint that swings to and fro always turned one way. And a speed of +1.18 rad/s, as a command, is 2147, which
# the register (0 to 2047) does not have. There is no error; the two functions bring back what the other made. A velocity in a policy's observation has the wrong sign half of the time.
# Seen on 2026-11-30:  mx: 99 -> -1.18 rad/s, 1123 -> -1.18 rad/s   load: 99 -> -9.68 %, 1123 -> +9.68 %   +1.18 rad/s -> 2147
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "speed"
version = "0.0.0"
edition = "2021"

[dependencies]
rustypot = { version = "=1.13.1", default-features = false }
TOML
cat > src/main.rs <<'RS'
use rustypot::servo::dynamixel::{ax, mx, xl320};

fn main() {
    let functions: [(&str, fn(u16) -> f64, fn(f64) -> u16, fn(u16) -> f64); 3] = [
        ("mx", mx::conv::dxl_oriented_speed_to_rad_per_sec, mx::conv::rad_per_sec_to_dxl_oriented_speed, mx::conv::dxl_load_to_oriented_torque),
        ("ax", ax::conv::dxl_oriented_speed_to_rad_per_sec, ax::conv::rad_per_sec_to_dxl_oriented_speed, ax::conv::dxl_load_to_oriented_torque),
        ("xl320", xl320::conv::xl320_oriented_speed_to_rad_per_sec, xl320::conv::rad_per_sec_to_xl320_oriented_speed, xl320::conv::xl320_load_to_oriented_torque),
    ];
    for (name, speed, command, load) in functions {
        let (one, other) = (speed(99), speed(1024 + 99));
        println!("SEEN {name}: 99 -> {one:.2} rad/s, 1123 -> {other:.2} rad/s   load: {:.2} %, {:+.2} %   {:+.2} rad/s -> {}", load(99), load(1123), -one, command(-one + 1e-9));
        assert!(one < -1.1 && other == one && load(99) == -load(1123) && load(99) < 0.0);
        assert_eq!(command(-one + 1e-9), 2048 + 99);
    }
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
