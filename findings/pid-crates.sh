#!/bin/sh
# pid 4.0.0, pid-ctrl 0.1.4, advanced-pid 0.2.3 (crates.io): three controllers, one set of gains, three behaviours. pid has no time step: its integral and derivative are per call, so that at 1 kHz an integral gain of 1 is one of 1000
# per second, and a loop that is made faster is another controller. A gain that is set through its public field has no effect, since the term's limit is 0 until it is set. pid-ctrl starts with a measurement of 0: a joint that
# rests at its setpoint of 1 gets -100 in its first step (kd 0.1). advanced-pid does not stop its integral at its output's limits: after 10 s at the limit, it stays there for 19 s with the error turned. There is no error.
# Seen on 2026-11-30:  integral after 1 s of an error of 1, ki 1, at 100 Hz and 1 kHz: pid 100, 1000   pid-ctrl and advanced-pid 1.0, 1.0   kp by its field: 0   first step at rest: pid 0, pid-ctrl -100, advanced-pid 0   windup: 19.0 s
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "controllers"
version = "0.0.0"
edition = "2021"

[dependencies]
pid = "=4.0.0"
pid-ctrl = "=0.1.4"
advanced-pid = "=0.2.3"
TOML
cat > src/main.rs <<'RS'
use advanced_pid::{PidConfig, PidController};
use pid_ctrl::{PidCtrl, PidIn};

/// The outputs of the three after 1 s of an error of 1, with an integral gain of 1.
fn integrals(hertz: u16) -> [f64; 3] {
    let step = 1.0 / f64::from(hertz);
    let mut first = pid::Pid::<f64>::new(1.0, 1e9);
    first.i(1.0, 1e9);
    let mut second = PidCtrl::<f64>::new_with_pid(0.0, 1.0, 0.0);
    second.setpoint = 1.0;
    let mut third = advanced_pid::Pid::new(PidConfig::new(0.0, 1.0, 0.0));
    let mut seen = [0.0; 3];
    for _ in 0..hertz {
        seen = [first.next_control_output(0.0).output, second.step(PidIn::new(0.0, step)).out, third.update(1.0, 0.0, step as f32).into()];
    }
    seen
}

fn main() {
    let (slow, fast) = (integrals(100), integrals(1000));

    let mut by_field = pid::Pid::<f64>::new(1.0, 1e9);
    by_field.kp = 10.0;
    let without = by_field.next_control_output(0.0).output;

    let mut first = pid::Pid::<f64>::new(1.0, 1e9);
    first.d(0.1, 1e9);
    let mut second = PidCtrl::<f64>::new_with_pid(0.0, 0.0, 0.1);
    second.setpoint = 1.0;
    let mut third = advanced_pid::Pid::new(PidConfig::new(0.0, 0.0, 0.1));
    let rest = [first.next_control_output(1.0).output, second.step(PidIn::new(1.0, 0.001)).out, third.update(1.0, 1.0, 0.001).into()];

    let mut wound = advanced_pid::Pid::new(PidConfig::new(1.0, 1.0, 0.0).with_limits(-1.0, 1.0));
    (0..10_000).for_each(|_| assert_eq!(wound.update(1.0, 0.0, 0.001), 1.0));
    let held = (0..100_000).take_while(|_| wound.update(0.0, 0.5, 0.001) > 0.0).count() as f64 / 1000.0;

    println!("SEEN integrals at 100 Hz {slow:.2?}, at 1 kHz {fast:.2?}; kp by its field {without}; at rest {rest:.1?}; windup {held:.1} s");
    assert_eq!([slow[0], fast[0]], [100.0, 1000.0]);
    assert!([slow[1], fast[1], slow[2], fast[2]].iter().all(|value| (value - 1.0).abs() < 0.001));
    assert_eq!(without, 0.0);
    assert!(rest[0] == 0.0 && (rest[1] + 100.0).abs() < 1e-9 && rest[2] == 0.0);
    assert!((held - 19.0).abs() < 0.1);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
