//! Requests, each repeated until the controller answers.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use actq_link::code::{Parameter, Refusal, Report, State};
use actq_link::report::{Breadcrumb, Status, Timing};
use actq_link::{Floats, Message};
use anyhow::{Context as _, Result, bail};

use crate::connection::Connection;
use crate::event::Event;

/// Time without an answer before a request is sent again. It grows by half with each repetition, so that repetitions do
/// not fill a slow line.
const REPEAT: Duration = Duration::from_millis(150);
/// Longest time between two repetitions.
const MAX_REPEAT: Duration = Duration::from_secs(1);
/// Least number of attempts of a change, each with the current token.
const ATTEMPTS: usize = 3;

/// Fails, with the reason, if a controller that was armed is not any more.
pub(crate) fn require_armed(status: &Status) -> Result<()> {
    if status.state != State::Armed {
        // A fault stays in the status after the controller was disarmed.
        match status.fault {
            Some(fault) if status.state == State::Latched => bail!("the controller is {}: {fault}", status.state),
            _ => bail!("the controller is {}", status.state),
        }
    }
    Ok(())
}

/// Client of a controller.
pub struct Client {
    connection: Connection,
    /// Time after which a request is given up.
    timeout: Duration,
    /// Received events that answered no request.
    events: VecDeque<Event>,
}

impl Client {
    /// Creates a client on a connection. It gives up a request after `timeout`.
    pub const fn new(connection: Connection, timeout: Duration) -> Self {
        Self { connection, timeout, events: VecDeque::new() }
    }

    /// Returns the connection.
    pub const fn connection(&self) -> &Connection {
        &self.connection
    }

    /// Returns the connection, to send raw bytes.
    pub const fn connection_mut(&mut self) -> &mut Connection {
        &mut self.connection
    }

    /// Sends an observation and returns its sequence number.
    ///
    /// # Errors
    ///
    /// Fails as [`Connection::send`] does.
    pub fn observe(&mut self, values: &[f32]) -> Result<u32> {
        self.connection.send(&Message::Observation(Floats::Values(values)))
    }

    /// Returns the events since the last call that answered no request.
    ///
    /// # Errors
    ///
    /// Fails as [`Connection::poll`] does.
    pub fn events(&mut self) -> Result<VecDeque<Event>> {
        let events = &mut self.events;
        self.connection.poll(|event| events.push_back(event))?;
        Ok(std::mem::take(&mut self.events))
    }

    /// Sends `message` until `wanted` accepts an event as the answer to one of the sequence numbers used. Other events
    /// are kept.
    fn ask<T>(&mut self, message: &Message<'_>, wanted: impl Fn(&Event, &[u32]) -> Option<T>) -> Result<T> {
        let begun = Instant::now();
        let (mut numbers, mut wait) = (Vec::new(), REPEAT);
        loop {
            numbers.push(self.connection.send(message)?);
            let (sent, was_open) = (Instant::now(), self.connection.is_open());
            // Each loop checks the time at its end: an answer that came while this process stood still is read.
            loop {
                let (mut answer, events) = (None, &mut self.events);
                self.connection.poll(|event| match wanted(&event, &numbers) {
                    Some(found) if answer.is_none() => answer = Some(found),
                    _ => events.push_back(event),
                })?;
                if let Some(answer) = answer {
                    return Ok(answer);
                }
                if sent.elapsed() >= wait {
                    break;
                }
            }
            wait = wait.mul_f64(1.5).min(MAX_REPEAT);
            // A lost port ends the wait early, and the request is repeated after reconnecting. A port that opens and
            // closes again and again never reconnects.
            let (waited, is_over) = (begun.elapsed(), if was_open { self.timeout } else { 2 * self.timeout });
            if waited >= is_over {
                bail!("no answer for {waited:.1?}: {}", self.connection.silence());
            }
        }
    }

    /// Sends a request until it is acknowledged. Returns the accepted bytes of the update, and the outcome.
    ///
    /// # Errors
    ///
    /// Fails without an answer.
    pub fn request(&mut self, message: &Message<'_>) -> Result<(u32, Result<(), Refusal>)> {
        self.ask(message, |event, numbers| match event {
            Event::Ack { of, refusal, written } if numbers.contains(of) => {
                Some((*written, refusal.map_or(Ok(()), Err)))
            }
            _ => None,
        })
    }

    /// Returns the current status.
    ///
    /// # Errors
    ///
    /// Fails without an answer.
    pub fn status(&mut self) -> Result<Status> {
        // A status from before the request may be outdated.
        self.events()?
            .into_iter()
            .filter(|event| !matches!(event, Event::Status(_)))
            .for_each(|e| self.events.push_back(e));
        self.ask(&Message::Ask(Report::Status), |event, _| match event {
            Event::Status(status) => Some(*status),
            _ => None,
        })
    }

    /// Returns the measured times.
    ///
    /// # Errors
    ///
    /// Fails without an answer.
    pub fn timing(&mut self) -> Result<Timing> {
        self.ask(&Message::Ask(Report::Timing), |event, _| match event {
            Event::Timing(timing) => Some(*timing),
            _ => None,
        })
    }

    /// Returns the crash record of the last run.
    ///
    /// # Errors
    ///
    /// Fails without an answer.
    pub fn breadcrumb(&mut self) -> Result<Breadcrumb> {
        self.ask(&Message::Ask(Report::Breadcrumb), |event, _| match event {
            Event::Breadcrumb(breadcrumb) => Some(*breadcrumb),
            _ => None,
        })
    }

    /// Returns a parameter.
    ///
    /// # Errors
    ///
    /// Fails for an unknown parameter or axis, or without an answer.
    pub fn get(&mut self, wanted: Parameter, of_axis: u8) -> Result<f32> {
        let answer = self.ask(&Message::Get { parameter: wanted, axis: of_axis }, |event, numbers| match event {
            Event::Value { parameter, axis, value } if (*parameter, *axis) == (wanted, of_axis) => Some(Ok(*value)),
            Event::Ack { of, refusal: Some(refusal), .. } if numbers.contains(of) => Some(Err(*refusal)),
            _ => None,
        })?;
        answer.with_context(|| format!("cannot read {wanted} of axis {of_axis}"))
    }

    /// Sets a parameter.
    ///
    /// # Errors
    ///
    /// Fails if the controller refuses, or without an answer.
    pub fn set(&mut self, parameter: Parameter, axis: u8, value: f32) -> Result<()> {
        let outcome = self.change(|token| Message::Set { token, parameter, axis, value })?;
        outcome.with_context(|| format!("cannot set {parameter} of axis {axis} to {value}"))
    }

    /// Arms the controller. If one of several repetitions of the request may have armed it, and it is not armed any
    /// more, it is not armed again: it may have stopped for a reason.
    ///
    /// # Errors
    ///
    /// Fails if the controller refuses, does not answer, or may have stopped since.
    pub fn arm(&mut self) -> Result<()> {
        let begun = Instant::now();
        let outcome = loop {
            let outcome = self.change_unless(
                |token| Message::Arm { token },
                |client, sent| {
                    // A repetition whose first answer was lost has an old token, too.
                    let status = client.status()?;
                    if sent > 1 {
                        require_armed(&status)
                            .context("not armed, or not any more; find out why it stopped, then arm it again")?;
                    }
                    Ok(status.state == State::Armed)
                },
            )?;
            // After a disarm, outputs coast only from the next tick on.
            if outcome != Err(Refusal::Busy) || begun.elapsed() >= self.timeout {
                break outcome;
            }
        };
        outcome.context("not armed")?;
        // Earlier statuses describe the earlier state.
        self.events.retain(|event| !matches!(event, Event::Status(_)));
        Ok(())
    }

    /// Disarms the controller.
    ///
    /// # Errors
    ///
    /// Fails without an answer.
    pub fn disarm(&mut self) -> Result<()> {
        self.request(&Message::Disarm)?.1.context("not disarmed")
    }

    /// Sends a request that may be repeated, with the current token, until the token is accepted or the time is over.
    pub(crate) fn change<'m>(&mut self, message: impl Fn(u32) -> Message<'m>) -> Result<Result<(), Refusal>> {
        self.change_unless(message, |_, _| Ok(false))
    }

    /// Repeats the request with new tokens until one is accepted, `is_done` is true, or the time is over: a repetition
    /// of an earlier request, or a silent line, may have changed the token again. `is_done` also takes how often the
    /// refused request was sent.
    fn change_unless<'m>(
        &mut self,
        message: impl Fn(u32) -> Message<'m>,
        is_done: impl Fn(&mut Self, usize) -> Result<bool>,
    ) -> Result<Result<(), Refusal>> {
        let (begun, mut attempts) = (Instant::now(), 0);
        loop {
            let (outcome, sent) = self.with_token(&message)?;
            if outcome != Err(Refusal::Token) {
                return Ok(outcome);
            }
            if is_done(self, sent)? {
                return Ok(Ok(()));
            }
            attempts += 1;
            if attempts >= ATTEMPTS && begun.elapsed() >= self.timeout {
                return Ok(outcome);
            }
        }
    }

    /// Sends a request with the current token; returns the outcome, and how often it was sent.
    fn with_token<'m>(&mut self, message: impl FnOnce(u32) -> Message<'m>) -> Result<(Result<(), Refusal>, usize)> {
        let token = self.status()?.token;
        self.ask(&message(token), |event, numbers| match event {
            Event::Ack { of, refusal, .. } if numbers.contains(of) => {
                Some((refusal.map_or(Ok(()), Err), numbers.len()))
            }
            _ => None,
        })
    }
}
