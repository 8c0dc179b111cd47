#!/bin/sh
# mpu6050-dmp 0.6.1 (crates.io, an MPU-6050 with its motion processor): Quaternion::from_bytes() is documented as scaled to -1 to 1, and its numbers are 65,536 times that: the processor's four numbers of 32 bits have 30 bits after the
# point, and 14 are taken. As YawPitchRoll::from() subtracts 1 from such a square, a turn by 90 degrees is a yaw of -45, and a turn by 180 of -90; Gravity, "approximately 1g", is 4.3e9. After normalize() the sizes are right, and yaw and
# pitch still have the opposite sign of the rotation around the axis that they are documented for, where roll has the same: a balancing robot that takes roll and pitch from it pushes with one axis and not with the other.
# There is no error.
# Seen on 2026-11-30:  at rest: magnitude 65536, gravity z 4.3e9   turns of 60 degrees about z, y, x: yaw -30, pitch -60, roll 60   normalized: yaw -60, pitch -60, roll 60   about z by 90, 180: yaw -45, -90
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "orientation"
version = "0.0.0"
edition = "2021"

[dependencies]
mpu6050-dmp = "=0.6.1"
TOML
cat > src/main.rs <<'RS'
use mpu6050_dmp::gravity::Gravity;
use mpu6050_dmp::quaternion::Quaternion;
use mpu6050_dmp::yaw_pitch_roll::YawPitchRoll;

/// The bytes of the processor for a turn of the sensor (degrees) about one of its axes: w, x, y, z as i32 with 30 bits after the point.
fn bytes(axis: usize, degrees: f64) -> [u8; 16] {
    let half = degrees.to_radians() / 2.0;
    let mut q = [half.cos(), 0.0, 0.0, 0.0];
    q[1 + axis] = half.sin();
    let mut out = [0; 16];
    for (index, value) in q.iter().enumerate() {
        out[4 * index..4 * index + 4].copy_from_slice(&((value * f64::from(1 << 30)).round() as i32).to_be_bytes());
    }
    out
}

/// Yaw, pitch and roll in degrees.
fn angles(q: Quaternion) -> [f32; 3] {
    let angles = YawPitchRoll::from(q);
    [angles.yaw, angles.pitch, angles.roll].map(f32::to_degrees)
}

fn main() {
    let rest = Quaternion::from_bytes(&bytes(0, 0.0)).unwrap();
    let (magnitude, gravity) = (rest.magnitude(), Gravity::from(rest).z);
    let raw = |axis, degrees| angles(Quaternion::from_bytes(&bytes(axis, degrees)).unwrap());
    let normalized = |axis, degrees| angles(Quaternion::from_bytes(&bytes(axis, degrees)).unwrap().normalize());
    let (z, y, x) = (raw(2, 60.0), raw(1, 60.0), raw(0, 60.0));
    let (nz, ny, nx) = (normalized(2, 60.0), normalized(1, 60.0), normalized(0, 60.0));
    let (quarter, half) = (raw(2, 90.0)[0], raw(2, 179.9)[0]);
    println!("SEEN magnitude {magnitude}, gravity {gravity:.1e}; 60 degrees: yaw {:.1}, pitch {:.1}, roll {:.1}; normalized {:.1}, {:.1}, {:.1}; about z by 90, 180: {quarter:.1}, {half:.1}", z[0], y[1], x[2], nz[0], ny[1], nx[2]);
    let near = |a: f32, b: f32| (a - b).abs() < 0.1;
    assert!(magnitude == 65536.0 && gravity > 4.2e9);
    assert!(near(z[0], -30.0) && near(y[1], -60.0) && near(x[2], 60.0));
    assert!(near(nz[0], -60.0) && near(ny[1], -60.0) && near(nx[2], 60.0));
    assert!(near(quarter, -45.0) && near(half, -90.0));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
