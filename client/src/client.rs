//! Requests, each repeated until it is answered.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use actq_link::code::{Parameter, Refusal, Report, State};
use actq_link::report::{Breadcrumb, Status, Timing};
use actq_link::{Floats, Message};
use anyhow::{Context as _, Result, bail};

use crate::connection::Connection;
use crate::event::Event;

/// After so long without an answer a request is sent again, then after half as long again each time: a slow line is not
/// to be filled with repetitions.
const REPEAT: Duration = Duration::from_millis(150);
/// But no longer than this.
const SLOWEST: Duration = Duration::from_secs(1);
/// How often a change is asked for, each time with the token of now.
const TRIES: usize = 3;

/// A controller, to ask.
pub struct Client {
    connection: Connection,
    /// How long a request is repeated.
    patience: Duration,
    /// What came and was not asked for.
    events: VecDeque<Event>,
}

impl Client {
    /// Over a connection; gives a request up after `patience`.
    pub const fn new(connection: Connection, patience: Duration) -> Self {
        Self { connection, patience, events: VecDeque::new() }
    }

    /// The connection.
    pub const fn connection(&self) -> &Connection {
        &self.connection
    }

    /// The connection, to send bytes of one's own.
    pub const fn connection_mut(&mut self) -> &mut Connection {
        &mut self.connection
    }

    /// Sends an observation and gives its sequence number.
    ///
    /// # Errors
    ///
    /// As [`Connection::send`].
    pub fn observe(&mut self, values: &[f32]) -> Result<u32> {
        self.connection.send(&Message::Observation(Floats::Values(values)))
    }

    /// What came since, and was not asked for.
    ///
    /// # Errors
    ///
    /// As [`Connection::poll`].
    pub fn events(&mut self) -> Result<VecDeque<Event>> {
        let events = &mut self.events;
        self.connection.poll(|event| events.push_back(event))?;
        Ok(std::mem::take(&mut self.events))
    }

    /// Sends `message` until `wanted` takes an event as the answer to one of the numbers it was sent under. The others
    /// are kept.
    fn ask<T>(&mut self, message: &Message<'_>, wanted: impl Fn(&Event, &[u32]) -> Option<T>) -> Result<T> {
        let begun = Instant::now();
        let (mut numbers, mut wait) = (Vec::new(), REPEAT);
        while begun.elapsed() < self.patience {
            numbers.push(self.connection.send(message)?);
            let sent = Instant::now();
            while sent.elapsed() < wait {
                let (mut answer, events) = (None, &mut self.events);
                self.connection.poll(|event| match answer.take().or_else(|| wanted(&event, &numbers)) {
                    Some(found) => answer = Some(found),
                    None => events.push_back(event),
                })?;
                if let Some(answer) = answer {
                    return Ok(answer);
                }
            }
            wait = wait.mul_f64(1.5).min(SLOWEST);
        }
        bail!("no answer for {:.1?}: {}", self.patience, self.connection.silence())
    }

    /// Sends a request until it is acknowledged: bytes of the update that were taken, and why it was not done.
    ///
    /// # Errors
    ///
    /// Where there is no answer.
    pub fn request(&mut self, message: &Message<'_>) -> Result<(u32, Result<(), Refusal>)> {
        self.ask(message, |event, numbers| match event {
            Event::Ack { of, refusal, written } if numbers.contains(of) => {
                Some((*written, refusal.map_or(Ok(()), Err)))
            }
            _ => None,
        })
    }

    /// The status of now.
    ///
    /// # Errors
    ///
    /// Where there is no answer.
    pub fn status(&mut self) -> Result<Status> {
        // One that came before it was asked for may be an old one.
        self.events()?
            .into_iter()
            .filter(|event| !matches!(event, Event::Status(_)))
            .for_each(|e| self.events.push_back(e));
        self.ask(&Message::Ask(Report::Status), |event, _| match event {
            Event::Status(status) => Some(*status),
            _ => None,
        })
    }

    /// How long things take.
    ///
    /// # Errors
    ///
    /// Where there is no answer.
    pub fn timing(&mut self) -> Result<Timing> {
        self.ask(&Message::Ask(Report::Timing), |event, _| match event {
            Event::Timing(timing) => Some(*timing),
            _ => None,
        })
    }

    /// What the last run left behind.
    ///
    /// # Errors
    ///
    /// Where there is no answer.
    pub fn breadcrumb(&mut self) -> Result<Breadcrumb> {
        self.ask(&Message::Ask(Report::Breadcrumb), |event, _| match event {
            Event::Breadcrumb(breadcrumb) => Some(*breadcrumb),
            _ => None,
        })
    }

    /// A parameter.
    ///
    /// # Errors
    ///
    /// Where there is none, or no answer.
    pub fn get(&mut self, which: Parameter, whose: u8) -> Result<f32> {
        let answer = self.ask(&Message::Get { parameter: which, axis: whose }, |event, numbers| match event {
            Event::Value { parameter, axis, value } if (*parameter, *axis) == (which, whose) => Some(Ok(*value)),
            Event::Ack { of, refusal: Some(refusal), .. } if numbers.contains(of) => Some(Err(*refusal)),
            _ => None,
        })?;
        answer.with_context(|| format!("{which} of axis {whose}"))
    }

    /// Sets a parameter.
    ///
    /// # Errors
    ///
    /// Where it is refused, or there is no answer.
    pub fn set(&mut self, parameter: Parameter, axis: u8, value: f32) -> Result<()> {
        let outcome = self.change(|token| Message::Set { token, parameter, axis, value })?;
        outcome.with_context(|| format!("{parameter} of axis {axis} is not set to {value}"))
    }

    /// Arms.
    ///
    /// # Errors
    ///
    /// Where it is refused, or there is no answer.
    pub fn arm(&mut self) -> Result<()> {
        // A repeated request whose first answer was lost is refused for its token.
        let outcome = self.with_token(|token| Message::Arm { token })?;
        if !(outcome == Err(Refusal::Token) && self.status()?.state == State::Armed) {
            outcome.context("not armed")?;
        }
        // What was told before speaks of the state before.
        self.events.retain(|event| !matches!(event, Event::Status(_)));
        Ok(())
    }

    /// Disarms.
    ///
    /// # Errors
    ///
    /// Where there is no answer.
    pub fn disarm(&mut self) -> Result<()> {
        self.request(&Message::Disarm)?.1.context("not disarmed")
    }

    /// As [`Self::with_token`], for what may be asked whatever the state has become: a request before it that was
    /// repeated may have changed the token once more.
    pub(crate) fn change<'m>(&mut self, message: impl Fn(u32) -> Message<'m>) -> Result<Result<(), Refusal>> {
        let mut outcome = Err(Refusal::Token);
        for _ in 0..TRIES {
            outcome = self.with_token(&message)?;
            if outcome != Err(Refusal::Token) {
                break;
            }
        }
        Ok(outcome)
    }

    /// A request with the token of now.
    fn with_token<'m>(&mut self, message: impl FnOnce(u32) -> Message<'m>) -> Result<Result<(), Refusal>> {
        let token = self.status()?.token;
        Ok(self.request(&message(token))?.1)
    }
}
