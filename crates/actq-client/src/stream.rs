//! Sends observations at their rate and logs the actions.

use std::time::{Duration, Instant};

use actq_link::report::Status;
use anyhow::Result;

use crate::client::{Client, require_armed};
use crate::event::Event;
use crate::log::Log;

/// Options for sending observations.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Time from one observation to the next.
    pub period: Duration,
    /// `true` to arm after [`BEFORE_ARMING`] observations, and to disarm at the end.
    pub arm: bool,
}

/// Longest wait for the last action, counted from the controller's answer to a later request.
const LAST_ACTION: Duration = Duration::from_millis(100);
/// Observations that [`stream`] sends before it arms.
pub const BEFORE_ARMING: usize = 5;

/// Sends every observation at its time. Passes each received status to `seen`.
///
/// # Errors
///
/// Fails if the controller cannot be armed, is lost, or stops for a fault while armed. The log then has the actions so
/// far.
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
        // No burst follows if arming took longer than a period.
        due = (due + pace.period).max(Instant::now());
        listen(client, due, armed, log, &mut seen)?;
    }
    // The last action may be late. A controller that answers a later request has read the observation.
    if log.rows().last().is_some_and(|row| row.answer.is_none()) {
        client.status()?;
        listen(client, Instant::now() + pace.period.max(LAST_ACTION), armed, log, &mut seen)?;
    }
    if armed {
        client.disarm()?;
        listen(client, Instant::now(), false, log, &mut seen)?;
    }
    Ok(())
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
                    if armed {
                        require_armed(&status)?;
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
