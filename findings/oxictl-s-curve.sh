#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), SCurveGenerator for steppers: the way to stop is reckoned without the jerk limit, v * v / (2 a), but
# the brake is built up with it, so that each move comes to its target with much of its speed left. There the direction is taken anew from the sign
# of the rest at each call, and the command jumps between +v and -v from cycle to cycle, for 300 cycles, until the speed has run out. With v 1, a 2
# and j 10, a move of 1 m in cycles of 1 ms arrives with 0.63 m/s, and a reversal of that asks for 1250 m/s2. The source promises to avoid "the sharp
# corners of trapezoidal profiles". There is no error.
# Seen on 2026-11-30:  first reversal at 1.384 s: 0.627 to -0.625 m/s in 1 ms   172 reversals, 1252 m/s2 with a limit of 2, done after 1.698 s
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "curve"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::stepper::s_curve::{SCurveGenerator, SCurveProfile};

fn main() {
    let (top, limit, jerk, dt) = (1.0, 2.0, 10.0, 0.001);
    let mut motion = SCurveGenerator::<f64>::new(SCurveProfile::new(top, limit, jerk));
    motion.start_move(0.0, 1.0);
    let (mut before, mut cycles, mut reversals, mut fastest): (f64, u32, u32, f64) = (0.0, 0, 0, 0.0);
    while !motion.is_done() && cycles < 10_000 {
        let (speed, position) = motion.update(dt);
        if speed * before < 0.0 {
            if reversals == 0 {
                println!("SEEN first reversal at {:.3} s, at {position:.4} m: {before:.3} to {speed:.3} m/s", dt * f64::from(cycles));
            }
            reversals += 1;
        }
        fastest = fastest.max((speed - before).abs() / dt);
        before = speed;
        cycles += 1;
    }
    println!("SEEN {reversals} reversals, {fastest:.0} m/s2 with a limit of {limit}, done after {:.3} s", dt * f64::from(cycles));
    assert!(motion.is_done() && reversals > 100 && fastest > 500.0 * limit);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
