//! Sends observations at their rate, and keeps what comes back.

use std::time::{Duration, Instant};

use actq_link::code::State;
use actq_link::report::Status;
use anyhow::{Result, bail};

use crate::client::Client;
use crate::event::Event;
use crate::log::Log;

/// How observations are sent.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Time from one to the next.
    pub period: Duration,
    /// Arms once observations flow, and disarms at the end.
    pub arm: bool,
}

/// Observations that flow before arming.
const BEFORE_ARMING: usize = 5;

/// Sends every observation at its time. `seen` is told each status that comes.
///
/// # Errors
///
/// Where the controller cannot be armed, is lost, or stops for a fault while armed; the log holds what came until then.
pub fn stream(
    client: &mut Client,
    observations: impl Iterator<Item = Vec<f32>>,
    pace: &Pace,
    log: &mut Log,
    mut seen: impl FnMut(&Status),
) -> Result<()> {
    let (mut due, mut armed) = (Instant::now(), false);
    for (i, observation) in observations.enumerate() {
        if pace.arm && i == BEFORE_ARMING {
            client.arm()?;
            armed = true;
        }
        log.observed(client.observe(&observation)?, &observation);
        // Where arming took longer than a period, no burst makes up for it.
        due = (due + pace.period).max(Instant::now());
        listen(client, due, armed, log, &mut seen)?;
    }
    if armed {
        client.disarm()?;
    }
    // What is still on its way.
    listen(client, Instant::now() + pace.period.max(Duration::from_millis(100)), false, log, &mut seen)
}

fn listen(
    client: &mut Client,
    until: Instant,
    armed: bool,
    log: &mut Log,
    seen: &mut impl FnMut(&Status),
) -> Result<()> {
    loop {
        for event in client.events()? {
            match event {
                Event::Action { of, applied, values, .. } => log.acted(of, applied, values),
                Event::Status(status) => {
                    seen(&status);
                    if armed && status.state != State::Armed {
                        let why = status.fault.map_or("it was disarmed".to_owned(), |fault| fault.to_string());
                        bail!("the controller is {}: {why}", status.state);
                    }
                }
                _ => {}
            }
        }
        if Instant::now() >= until {
            return Ok(());
        }
    }
}
