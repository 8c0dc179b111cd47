#!/bin/sh
# sensor-fusion 0.1.13, vqf-rs 0.3.0 (crates.io): sensor-fusion's Madgwick filter never uses an accelerometer in m/s^2, the unit that its argument is named by (acc_mps2; the README's example is in g). It drops measurements whose squared
# length is above four times g, and at rest the squared length is g times g: the orientation is the gyroscope's alone, and drifts. In units of g the same filter works, and its Mahony filter works in both. Its
# Complementary filter ignores the accelerometer as constructed, in every unit: its gain begins at 1, which is the gyroscope's. There is no error. A robot that lies tilted is upright for a policy.
# Seen on 2026-11-29:  body at rest, rolled by 0.5 rad, after 10 s: Madgwick 0.00 with m/s^2, 0.46 with g   Complementary 0.00, 0.00   Mahony 0.50, 0.50   vqf-rs 0.50, 0.50
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "tilt"
version = "0.0.0"
edition = "2024"

[dependencies]
sensor-fusion = "=0.1.13"
vqf-rs = "=0.3.0"
vqm = "=0.1.19"
TOML
cat > src/main.rs <<'RS'
use sensor_fusion::{ComplementaryFilterf32, MadgwickFilterf32, MahonyFilterf32, SensorFusion};

const STEPS: usize = 10_000;
const DT: f64 = 0.001;
const ROLL: f64 = 0.5;

/// The roll of a quaternion (w, x, y, z) about the x axis only.
fn roll(w: f64, x: f64) -> f64 {
    2.0 * x.atan2(w)
}

fn own(mut filter: impl SensorFusion<f32>, gravity: f64) -> f64 {
    let acceleration = vqm::Vector3f32::new(0.0, (gravity * ROLL.sin()) as f32, (gravity * ROLL.cos()) as f32);
    let mut q = vqm::Quaternionf32::default();
    for _ in 0..STEPS {
        q = filter.fuse_acc_gyro(acceleration, vqm::Vector3f32::new(0.0, 0.0, 0.0), DT as f32);
    }
    roll(q.w.into(), q.x.into())
}

fn main() {
    let mut seen = Vec::new();
    for gravity in [9.81, 1.0] {
        let acceleration = [0.0, gravity * ROLL.sin(), gravity * ROLL.cos()];
        let mut vqf = vqf_rs::VQF::new(DT, None, None, None);
        for _ in 0..STEPS {
            vqf.update([0.0; 3], acceleration, None);
        }
        let q = vqf.quat_6d();
        let rolls = [
            own(MadgwickFilterf32::new(), gravity),
            own(ComplementaryFilterf32::new(), gravity),
            own(MahonyFilterf32::new(), gravity),
            roll(q.0, q.1),
        ];
        println!("gravity is {gravity}: Madgwick {:.2}, Complementary {:.2}, Mahony {:.2}, vqf-rs {:.2} rad", rolls[0], rolls[1], rolls[2], rolls[3]);
        seen.push(rolls);
    }
    let tilted = |roll: f64| (roll - ROLL).abs() < 0.02;
    assert!(seen[0][0] == 0.0 && seen[1][0] > 0.4);
    assert!(seen.iter().all(|rolls| rolls[1] == 0.0 && rolls[2..].iter().all(|&roll| tilted(roll))));
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
