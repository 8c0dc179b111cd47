#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), HBridge: the low side that must close the circuit gets the rest of the period instead of staying on.
# compute(1.0) gives HA 1 and LB 0: at full forward no current can flow, while `effective`, "Effective duty cycle applied to motor", says 1. The
# source says "positive command" puts HA and LB on. The two are on together for min(duty, 1 - duty) of the period at most: the voltage rises up to a
# command of 0.5 and falls above it. A controller with an integral then goes to full command and stays there, with the motor at standstill. There is
# no error.
# Seen on 2026-11-30:  command 0.2: HA 0.2, LB 0.8   0.5: HA 0.5, LB 0.5   0.9: HA 0.9, LB 0.1   1.0: HA 1, LB 0, effective 1   -1.0: HB 1, LA 0,
# effective -1
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "bridge"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::dc::hbridge::HBridge;

fn main() {
    let mut bridge = HBridge::<f64>::new(0.0, 0.0);
    let mut most = Vec::new();
    for command in [0.2, 0.5, 0.7, 0.9, 1.0] {
        let (ahead, back) = (bridge.compute(command), bridge.compute(-command));
        // Current flows while the high side of one leg and the low side of the other are on.
        let both = ahead.ha.min(ahead.lb);
        println!("SEEN {command}: HA {:.1}, LB {:.1}, both on for {both:.1} at most; effective {:.1}", ahead.ha, ahead.lb, ahead.effective);
        assert_eq!((back.hb, back.la, back.effective), (ahead.ha, ahead.lb, -command));
        assert!((ahead.ha - command).abs() < 1e-9 && (ahead.lb - (1.0 - command)).abs() < 1e-9 && ahead.effective == command);
        most.push(both);
    }
    assert!(most[1] > most[0] && most[1] > most[2] && most[2] > most[3] && most[4] == 0.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
