#!/bin/sh
# tb6612fng 1.0.0 (crates.io, H-bridge for two motors): current_standby(), "Returns whether the standby mode is enabled", gives the opposite. It
# returns whether the standby pin is high, and this pin is high when standby is off: enable_standby() sets it low and disable_standby() high, as the
# chip wants it. After enable_standby() it says false, and with both motors driven it says true. A guard that moves on only if the motors are in
# standby does so while they run, and one that wakes them if they are in standby never does. The motors themselves obey. There is no error. And
# Motor::current_speed() goes on to give the speed of the last command in standby, so that neither method tells the truth there.
# Seen on 2026-12-01:  after new(): pin high, current_standby true   enable_standby(): pin low, false, current_speed 50   disable_standby(): pin high,
#                      true
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "standby"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-hal = "=1.0.0"
tb6612fng = "=1.0.0"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::{digital, pwm};
use std::{cell::Cell, convert::Infallible, rc::Rc};
use tb6612fng::{DriveCommand, Motor, Tb6612fng};

/// An output whose level can be seen from outside.
#[derive(Clone, Default)]
struct Pin(Rc<Cell<bool>>);

impl digital::ErrorType for Pin {
    type Error = Infallible;
}

impl digital::OutputPin for Pin {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }
}

impl digital::StatefulOutputPin for Pin {
    fn is_set_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }
    fn is_set_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}

struct Duty;

impl pwm::ErrorType for Duty {
    type Error = Infallible;
}

impl pwm::SetDutyCycle for Duty {
    fn max_duty_cycle(&self) -> u16 {
        100
    }
    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Infallible> {
        Ok(())
    }
}

fn main() {
    let standby = Pin::default();
    let motor = || Motor::new(Pin::default(), Pin::default(), Duty).unwrap();
    let mut chip = Tb6612fng::new(motor(), motor(), standby.clone()).unwrap();
    chip.motor_a.drive(DriveCommand::Forward(50)).unwrap();
    let mut seen = vec![(standby.0.get(), chip.current_standby().unwrap())];
    println!("SEEN after new() and drive(): pin high {}, current_standby {}", seen[0].0, seen[0].1);
    chip.enable_standby().unwrap();
    seen.push((standby.0.get(), chip.current_standby().unwrap()));
    println!("SEEN after enable_standby(): pin high {}, current_standby {}, current_speed {}", seen[1].0, seen[1].1, chip.motor_a.current_speed());
    chip.disable_standby().unwrap();
    seen.push((standby.0.get(), chip.current_standby().unwrap()));
    println!("SEEN after disable_standby(): pin high {}, current_standby {}", seen[2].0, seen[2].1);
    assert_eq!(seen, [(true, true), (false, false), (true, true)]);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
