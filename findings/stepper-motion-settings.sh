#!/bin/sh
# stepper-motion 0.1.1 (crates.io): three settings of its configuration are read, checked and then not used. A soft limit of the policy "clamp"
# ("Clamp target to nearest limit") stops nothing: move_to() asks whether the target is rejected, drops the clamped value and drives on, past the end
# of the axis. execute() of a named trajectory takes its target only: velocity_percent, acceleration and deceleration, the "asymmetric motion
# profiles" of the README, change nothing, and 10 percent run as fast as 100. backlash_compensation_deg ("applied on direction changes") adds no
# step. All calls return Ok.
# Seen on 2026-11-30:  limit 90 with clamp, move to 400: 399.6 degrees   90 degrees with 10 percent and a slow brake 1.45 s, with 100 percent 1.45 s
# backlash of 5 steps: 50 there, 50 back
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "settings"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-hal = "=1.0.0"
stepper-motion = "=0.1.1"
toml = "=0.8.23"
TOML
cat > src/main.rs <<'RS'
use embedded_hal::{delay::DelayNs, digital::{ErrorType, OutputPin}};
use std::{cell::RefCell, convert::Infallible, rc::Rc};
use stepper_motion::{motor::StepperMotorBuilder, Degrees, SystemConfig, TrajectoryRegistry};

const CONFIG: &str = r#"
[motors.axis]
name = "axis"
steps_per_revolution = 200
microsteps = 1
gear_ratio = 1.0
max_velocity_deg_per_sec = 180.0
max_acceleration_deg_per_sec2 = 360.0
backlash_compensation_deg = 10.0

[motors.axis.limits]
min_degrees = -90.0
max_degrees = 90.0
policy = "clamp"

[trajectories.slow]
motor = "axis"
target_degrees = 90.0
velocity_percent = 10
acceleration_deg_per_sec2 = 360.0
deceleration_deg_per_sec2 = 20.0

[trajectories.fast]
motor = "axis"
target_degrees = 90.0
velocity_percent = 100
"#;

/// The driver's steps, its direction, and its waiting time in ns.
#[derive(Default)]
struct Seen {
    clockwise: bool,
    place: i64,
    nanoseconds: u64,
    waits: Vec<u64>,
}

#[derive(Clone, Default)]
struct Board(Rc<RefCell<Seen>>);
struct Step(Board);
struct Dir(Board);

impl ErrorType for Step {
    type Error = Infallible;
}
impl ErrorType for Dir {
    type Error = Infallible;
}
impl OutputPin for Step {
    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut seen = self.0 .0.borrow_mut();
        seen.place += if seen.clockwise { 1 } else { -1 };
        Ok(())
    }
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
impl OutputPin for Dir {
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0 .0.borrow_mut().clockwise = true;
        Ok(())
    }
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0 .0.borrow_mut().clockwise = false;
        Ok(())
    }
}
impl DelayNs for Board {
    fn delay_ns(&mut self, nanoseconds: u32) {
        let mut seen = self.0.borrow_mut();
        seen.nanoseconds += u64::from(nanoseconds);
        seen.waits.push(u64::from(nanoseconds));
    }
}

fn main() {
    let config: SystemConfig = toml::from_str(CONFIG).unwrap();
    let registry = TrajectoryRegistry::from_config(&config);
    let build = |board: &Board| {
        let builder = StepperMotorBuilder::new().step_pin(Step(board.clone())).dir_pin(Dir(board.clone())).delay(board.clone());
        builder.from_motor_config(config.motor("axis").unwrap()).build().unwrap()
    };
    let board = Board::default();
    let motor = build(&board).move_to_blocking(Degrees(400.0)).ok().unwrap();
    let (degrees, steps) = (motor.position_degrees().0, board.0.borrow().place);
    println!("SEEN limits -90 .. 90 with clamp, move to 400: {degrees:.1} degrees, {steps} steps of 200 a turn");
    assert!(degrees > 399.0 && steps == 222);

    let times = ["slow", "fast"].map(|name| {
        let board = Board::default();
        assert!(build(&board).execute(name, &registry).is_ok());
        let seconds = board.0.borrow().nanoseconds as f64 / 1e9;
        seconds
    });
    println!("SEEN 90 degrees by execute(): with 10 percent and a slow brake {:.2} s, with 100 percent {:.2} s", times[0], times[1]);
    assert_eq!(times[0], times[1]);

    let board = Board::default();
    let motor = build(&board).move_to_blocking(Degrees(90.0)).ok().unwrap();
    let there = board.0.borrow().place;
    let _ = motor.move_to_blocking(Degrees(0.0)).ok().unwrap();
    let back = there - board.0.borrow().place;
    println!("SEEN backlash of 10 degrees: {there} steps there, {back} back; the play is 5 steps");
    assert_eq!((there, back), (50, 50));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
