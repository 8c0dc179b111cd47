#!/bin/sh
# foc 0.3.0 (crates.io): its controllers take the error as measurement minus setpoint and add it: with positive gains, which other controllers of crates.io need, the current loop of a motor drives
# the current away, -24 A where 1 A is wanted, to the limit of the voltage. Neither README nor documentation says that gains have to be negative; with negative ones it settles. And for
# the same voltage its SpaceVector modulation gives 1.155 times (2 / sqrt 3) the one that Sinusoidal gives between the phases, so that exchanging the two changes the loop's gain.
# Seen on 2026-11-29:  foc, gains 0.5 and 100: -24.0 A   foc, gains -0.5 and -100: 1.0 A   pid 4.0.0, pid-ctrl 0.1.4, positive gains: 1.0 A   SpaceVector to Sinusoidal 1.155
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "current"
version = "0.0.0"
edition = "2024"

[dependencies]
fixed = "=1.31.0"
foc = "=0.3.0"
pid = "=4.0.0"
pid-ctrl = "=0.1.4"
TOML
cat > src/main.rs <<'RS'
use fixed::types::I16F16;
use foc::park_clarke::TwoPhaseReferenceFrame;
use foc::pid::PIController;
use foc::pwm::{Modulation, Sinusoidal, SpaceVector};
use pid_ctrl::{PidCtrl, PidIn};

const DT: f64 = 1e-4;

/// The current of a winding (0.5 ohm, 1 mH, 12 V) after 0.1 s of a controller that wants 1 A.
fn settles(mut voltage: impl FnMut(f64) -> f64) -> f64 {
    let mut current = 0.0;
    for _ in 0..1000 {
        current += (voltage(current).clamp(-12.0, 12.0) - 0.5 * current) / 1e-3 * DT;
    }
    current
}

fn foc(proportional: f64, integral: f64) -> f64 {
    let mut controller = PIController::new(I16F16::from_num(proportional), I16F16::from_num(integral));
    settles(|current| controller.update(I16F16::from_num(current), I16F16::ONE, I16F16::from_num(DT)).to_num())
}

fn phases<M: Modulation>(angle: f64) -> [f64; 2] {
    let value = TwoPhaseReferenceFrame { alpha: I16F16::from_num(0.5 * angle.cos()), beta: I16F16::from_num(0.5 * angle.sin()) };
    let [a, b, c] = M::modulate(value).map(|x| x.to_num::<f64>());
    [a - b, b - c]
}

fn main() {
    let mut pid = pid::Pid::<f64>::new(1.0, 12.0);
    pid.p(0.5, 12.0).i(100.0 * DT, 12.0);
    let mut ctrl = PidCtrl::<f64>::new_with_pid(0.5, 100.0, 0.0);
    ctrl.init(1.0, 0.0);
    let peers = [settles(|current| pid.next_control_output(current).output), settles(|current| ctrl.step(PidIn::new(current, DT)).out)];
    let own = [foc(0.5, 100.0), foc(-0.5, -100.0)];
    println!("foc, positive gains {:.1} A, negative gains {:.1} A; pid and pid-ctrl, positive gains {:.1} and {:.1} A", own[0], own[1], peers[0], peers[1]);
    assert!(own[0] < -20.0 && (own[1] - 1.0).abs() < 0.1 && peers.iter().all(|current| (current - 1.0).abs() < 0.1));
    for step in 0..12 {
        let angle = 0.1 + f64::from(step) * 0.5;
        let (vector, sine) = (phases::<SpaceVector>(angle), phases::<Sinusoidal>(angle));
        assert!((0..2).all(|i| (vector[i] - 1.1547 * sine[i]).abs() < 1e-3), "{vector:?} {sine:?}");
    }
    println!("SpaceVector to Sinusoidal between phases: 1.155");
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
