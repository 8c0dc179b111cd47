#!/bin/sh
# l298n 0.2.0 (crates.io, dual H-bridge of brushed motors): stop() is brake(). By its documentation it is the "Free Running Motor Stop", with the
# enable input low and both other inputs of no matter; the code sets both inputs high, as brake() does, and leaves the PWM on: the windings are
# shorted, and a wheel or an arm that has to coast stops with a jerk. forward() and reverse() are exchanged against their documentation: "Ven = H then
# C = H ; D = L Forward", where C is the first input, and the code sets the first low and the second high for forward(). set_duty(0) gives the free
# run. There is no error.
# Seen on 2026-11-30:  stop(): inputs 1, 1, duty 100 (documented: enable low)   brake(): 1, 1, 100   forward(): 0, 1 (documented 1, 0)   reverse(): 1,
# 0 (documented 0, 1)
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "stop"
version = "0.0.0"
edition = "2021"

[dependencies]
l298n = "=0.2.0"
embedded-hal = { version = "=0.2.7", features = ["unproven"] }
TOML
cat > src/main.rs <<'RS'
use embedded_hal::{digital::v2::OutputPin, PwmPin};
use l298n::Motor;
use std::{cell::Cell, convert::Infallible};

struct Pin<'a>(&'a Cell<u8>);

impl OutputPin for Pin<'_> {
    type Error = Infallible;
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(0);
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(1);
        Ok(())
    }
}

/// The enable input: the duty in percent, 0 while it is off.
struct Enable<'a>(&'a Cell<u8>);

impl PwmPin for Enable<'_> {
    type Duty = u8;
    fn disable(&mut self) {
        self.0.set(0);
    }
    fn enable(&mut self) {}
    fn get_duty(&self) -> u8 {
        self.0.get()
    }
    fn get_max_duty(&self) -> u8 {
        100
    }
    fn set_duty(&mut self, duty: u8) {
        self.0.set(duty);
    }
}

fn main() {
    let (first, second, enable) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let mut motor = Motor::new(Pin(&first), Pin(&second), Enable(&enable));
    let state = || (first.get(), second.get(), enable.get());
    motor.set_duty(100);
    motor.forward();
    let forward = state();
    motor.reverse();
    let reverse = state();
    motor.brake();
    let brake = state();
    motor.forward().stop();
    let stop = state();
    println!("SEEN first input, second input, duty: forward {forward:?}, reverse {reverse:?}, brake {brake:?}, stop {stop:?}");
    assert_eq!((forward, reverse), ((0, 1, 100), (1, 0, 100)));
    assert!(brake == (1, 1, 100) && stop == brake);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
