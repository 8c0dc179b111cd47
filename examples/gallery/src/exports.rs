//! The functions that the module exports.
#![allow(unsafe_code, reason = "exported names; there is no unsafe block")]

use std::cell::RefCell;

use crate::Robot;

thread_local! {
    static ROBOT: RefCell<Option<Robot>> = const { RefCell::new(None) };
}

fn with<T: Default>(work: impl FnOnce(&mut Robot) -> T) -> T {
    ROBOT.with_borrow_mut(|robot| robot.as_mut().map(work).unwrap_or_default())
}

/// Begins the episodes of a robot: 0 the balancer, 1 the arm.
#[unsafe(no_mangle)]
pub extern "C" fn begin(which: u32, seed: u32) {
    ROBOT.set(Some(Robot::new(which, seed.into())));
}

/// Returns the address of the observation.
#[unsafe(no_mangle)]
pub extern "C" fn observation() -> usize {
    with(|robot| robot.observation.as_ptr() as usize)
}

/// Returns the address of the action.
#[unsafe(no_mangle)]
pub extern "C" fn action() -> usize {
    with(|robot| robot.action.as_mut_ptr() as usize)
}

/// Returns the address of the values to draw, f64.
#[unsafe(no_mangle)]
pub extern "C" fn view() -> usize {
    with(|robot| robot.view.as_ptr() as usize)
}

/// Returns a number: 0 the values of an observation, 1 of an action, 2 of those to draw, 3 the error, 4 the episodes that
/// ended, 5 those with success.
#[unsafe(no_mangle)]
pub extern "C" fn number(which: u32) -> f64 {
    with(|robot| match which {
        0 => robot.observation.len() as f64,
        1 => robot.action.len() as f64,
        2 => robot.view.len() as f64,
        3 => robot.error,
        4 => f64::from(robot.episodes[0]),
        _ => f64::from(robot.episodes[1]),
    })
}

/// Applies the action; returns 1 if a new episode begins.
#[unsafe(no_mangle)]
pub extern "C" fn step() -> u32 {
    with(|robot| u32::from(robot.step()))
}

/// Pushes the robot.
#[unsafe(no_mangle)]
pub extern "C" fn push(strength: f64) {
    with(|robot| robot.push(strength));
}

/// Sets the goal.
#[unsafe(no_mangle)]
pub extern "C" fn aim(x: f64, y: f64, z: f64) {
    with(|robot| robot.aim([x, y, z]));
}
