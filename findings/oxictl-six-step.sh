#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), SixStepCommutator: two rows of the forward table, "Standard BLDC commutation", stand in each other's
# place. In the order of Hall states that the crate's own HallSensor decodes (5, 1, 3, 2, 6, 4) the field must turn by 60 degrees each time; it jumps
# by 180 twice, at the states 1 and 6, and goes back by 60 twice. A motor whose wires suit the other four sectors gets half of its torque backwards
# in these two, and sticks there. set_direction(false) is no reversal either: on the same motor its table pushes forward in five of six sectors.
# There is no error.
# Seen on 2026-11-30:  field forward 150, -30, 30, 90, -90, -150   torque forward -0.5, 1, 1, 1, -0.5, 1   torque with set_direction(false): 0.5,
# 0.5, 0.5, 0.5, 1, -0.5
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "commutation"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::bldc::six_step::{PhaseState, SixStepCommutator};
use oxictl::motor::encoder::hall::{hall_to_sector, sector_to_angle};

/// The Hall states in the order in which the crate's decoder counts its sectors.
const ORDER: [u8; 6] = [5, 1, 3, 2, 6, 4];

/// The direction of the field of three phases in degrees.
fn field(phases: [PhaseState; 3]) -> f64 {
    let (mut alpha, mut beta) = (0.0, 0.0);
    for (place, phase) in phases.iter().enumerate() {
        let current = match phase {
            PhaseState::High => 1.0,
            PhaseState::Low => -1.0,
            PhaseState::Off => 0.0,
        };
        let axis = (120.0 * place as f64).to_radians();
        alpha += current * axis.cos();
        beta += current * axis.sin();
    }
    f64::atan2(beta, alpha).to_degrees().round()
}

fn main() {
    let mut motor = SixStepCommutator::<f64>::new();
    motor.set_duty(1.0);
    let mut torques = Vec::new();
    for forward in [true, false] {
        motor.set_direction(forward);
        let fields = ORDER.map(|hall| field(motor.commutate(hall).0));
        // The torque by the sine of the angle from the rotor to the field, on a motor where the field of state 1 is 90 degrees ahead.
        let torque = ORDER.map(|hall| {
            let rotor = sector_to_angle::<f64>(hall_to_sector(hall).unwrap()).to_degrees();
            let lead = field(motor.commutate(hall).0) - rotor + 210.0;
            (lead.to_radians().sin() * 10.0).round() / 10.0
        });
        println!("SEEN forward {forward}: states {ORDER:?}, field {fields:?}, torque {torque:?}");
        torques.push(torque);
    }
    assert_eq!(torques[0], [-0.5, 1.0, 1.0, 1.0, -0.5, 1.0]);
    assert_eq!(torques[1], [0.5, 0.5, 0.5, 0.5, 1.0, -0.5]);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
