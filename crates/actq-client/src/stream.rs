//! Sends observations at their rate and logs the actions.

use std::time::{Duration, Instant};

use actq_link::PREFIX_SECONDS;
use actq_link::report::Status;
use anyhow::Result;

use crate::client::{Client, require_armed};
use crate::event::Event;
use crate::log::Log;
use crate::push::{Prefix, Push, push_prefix};

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
/// Time after which a prefix is sent again, half of its [`LIFETIME`].
const RENEWAL: Duration = Duration::from_secs(PREFIX_SECONDS as u64 / 2);
/// The longest lifetime of a prefix that the application accepts.
pub const LIFETIME: Duration = Duration::from_secs(PREFIX_SECONDS as u64);
/// Observations that [`stream`] sends before it arms.
pub const BEFORE_ARMING: usize = 5;

/// A prefix that the controller has, or that is on its way.
struct Sent<'p> {
    prefix: Prefix<'p>,
    /// Its transfer; `None` when the controller has it.
    push: Option<Push<'p>>,
    begun: Instant,
}

impl Sent<'_> {
    /// Makes the next request of the transfer, if one is left.
    fn advance(&mut self, client: &mut Client) -> Result<()> {
        if let Some(push) = &mut self.push
            && push.advance(client)?
        {
            self.push = None;
        }
        Ok(())
    }
}

/// Sends every observation at its time. Passes each received status to `seen`. `prefix` returns the prefix of each
/// observation by its number, if the image reads one: the first arrives before all observations. Another prefix is sent
/// between observations, and so is the same one after half of its [`LIFETIME`]; until it has arrived, the one before is used.
///
/// # Errors
///
/// Fails if the controller cannot be armed, refuses a prefix, is lost, or stops for a fault while armed. The log then has
/// the actions so far.
pub fn stream<'p>(
    client: &mut Client,
    observations: impl Iterator<Item = Vec<f32>>,
    prefix: impl Fn(usize) -> Option<Prefix<'p>>,
    pace: &Pace,
    log: &mut Log,
    mut seen: impl FnMut(&Status),
) -> Result<()> {
    let mut sent = prefix(0).map(|prefix| Sent { prefix, push: None, begun: Instant::now() });
    if let Some(Sent { prefix, .. }) = &sent {
        push_prefix(client, prefix)?;
    }
    let (mut due, mut armed) = (Instant::now(), false);
    for (i, observation) in observations.enumerate() {
        if let (Some(next), Some(last)) = (prefix(i), &mut sent)
            && last.push.is_none()
            && (next.bytes != last.prefix.bytes || last.begun.elapsed() > RENEWAL)
        {
            *last = Sent { prefix: next, push: Some(Push::prefix(client, next)?), begun: Instant::now() };
        }
        if pace.arm && i == BEFORE_ARMING {
            client.arm()?;
            armed = true;
        }
        log.observed(client.observe(&observation)?, &observation);
        // No burst follows if arming took longer than a period.
        due = (due + pace.period).max(Instant::now());
        listen(client, due, sent.as_mut(), armed, log, &mut seen)?;
    }
    // The last action may be late. A controller that answers a later request has read the observation.
    if log.rows().last().is_some_and(|row| row.answer.is_none()) {
        client.status()?;
        listen(client, Instant::now() + pace.period.max(LAST_ACTION), None, armed, log, &mut seen)?;
    }
    if armed {
        client.disarm()?;
        listen(client, Instant::now(), None, false, log, &mut seen)?;
    }
    Ok(())
}

fn listen(
    client: &mut Client,
    until: Instant,
    mut sent: Option<&mut Sent<'_>>,
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
        if let Some(sent) = &mut sent {
            sent.advance(client)?;
        }
        if Instant::now() >= until {
            return Ok(());
        }
    }
}
