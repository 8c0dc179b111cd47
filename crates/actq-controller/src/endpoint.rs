//! The controller's end of the link: it carries out each message and answers it.
//!
//! The firmware calls [`Endpoint::receive`] for every byte received and [`Endpoint::report`] regularly, and sends the
//! frames that they return. It runs the head on [`Endpoint::step`] and passes its action to [`Endpoint::acted`].
//!
//! An observation, its step and its action belong to the token ([`Safety::token`]) at the observation's arrival. When
//! the token changes they are dropped, and the head is reset. A status reports each token before the first action under
//! it. So a host that reads each token can predict every action, but those that a chunk plays while the next one is
//! computed: they depend on the time that it takes.

use core::mem;

use actq_link::code::{Fault, Parameter, Refusal, Report, State};
use actq_link::report::{Breadcrumb, Status, Timing};
use actq_link::{Floats, Message, Receiver, Sender};

use crate::guard::Guard;
use crate::requests::{Settings, request};
use crate::safety::{Safety, Shared};
use crate::update::Update;

/// Facts that a controller reports about itself, besides its decisions.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// CRC-32 from the header of the running image; 0 without one.
    pub image: u32,
    /// The running image's slot, 0 or 1, or [`actq_link::report::BUILT_IN`].
    pub slot: u8,
    /// Measured times.
    pub timing: Timing,
    /// The last reset's cause, and the crash record from before it.
    pub breadcrumb: Breadcrumb,
}

/// An observation for the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<'a> {
    /// Sequence number of the observation's frame.
    pub of: u32,
    /// `true` if the head must be reset first: the token differs from that of the previous step.
    pub reset: bool,
    /// The values of the observation.
    pub observation: &'a [f32],
}

/// The controller's end of the link. `OBS` is the capacity for an observation's values, `N` for a frame's bytes
/// ([`actq_link::frame::bytes`]).
#[derive(Debug)]
pub struct Endpoint<'r, const OBS: usize, const N: usize> {
    receiver: Receiver<N>,
    sender: Sender,
    guard: Guard<'r, OBS>,
    /// Facts that the firmware keeps up to date.
    pub facts: Facts,
    settings: Settings,
    /// Tick of the last status.
    reported_at: u32,
    /// Tick of the last good frame.
    heard_at: u32,
    /// [`Safety::token`] in the last status.
    reported_token: Option<u32>,
    /// [`Safety::token`] at the newest observation's arrival.
    observed_token: Option<u32>,
    /// [`Safety::token`] when the last step was returned.
    step_token: Option<u32>,
}

impl<'r, const OBS: usize, const N: usize> Endpoint<'r, OBS, N> {
    /// Creates an endpoint that has received nothing.
    pub const fn new(guard: Guard<'r, OBS>, facts: Facts, settings: Settings) -> Self {
        let receiver = Receiver::new();
        let sender = Sender::new(0);
        let [reported_token, observed_token, step_token] = [None; 3];
        Self {
            receiver,
            sender,
            guard,
            facts,
            settings,
            reported_at: 0,
            heard_at: 0,
            reported_token,
            observed_token,
            step_token,
        }
    }

    /// Returns `true` if writing flash stops the tick.
    pub const fn stalls(&self) -> bool {
        !self.settings.flash_while_armed
    }

    /// Takes a byte that arrived at `micros`; returns the frame to send for it, in `out`.
    ///
    /// `out` must hold [`actq_link::frame::wire_bytes`] of 46 bytes and of an action; a frame that does not fit is not
    /// sent.
    pub fn receive<'b, const AXES: usize>(
        &mut self,
        byte: u8,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        update: &mut impl Update,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let received = self.receiver.push(byte)?;
        self.heard_at = safety.with(|safety| safety.ticks());
        let (of, is_arm) = (received.sequence, matches!(received.message, Message::Arm { .. }));
        #[cfg(feature = "prefix")]
        let is_prefix = matches!(
            received.message,
            Message::BeginPrefix { .. } | Message::PrefixChunk { .. } | Message::CommitPrefix
        );
        let (guard, settings) = (&mut self.guard, &mut self.settings);
        let answer = match received.message {
            Message::Observation(values) => {
                safety.with(Safety::check_limits);
                if guard.take(of, values, received.micros, micros).is_ok() {
                    self.observed_token = Some(safety.with(|safety| {
                        safety.observed();
                        safety.token()
                    }));
                }
                return None;
            }
            Message::Ask(report) => Answer::Report(report),
            Message::Get { parameter, axis } => {
                let value = match parameter {
                    Parameter::MaxAge => Ok(guard.max_age() as f32),
                    Parameter::StatusPeriod => Ok(settings.status_period as f32),
                    other => safety.with(|safety| safety.get(other, axis)),
                };
                match value {
                    Ok(value) => Answer::Message(Message::Value { parameter, axis, value }),
                    Err(refusal) => Answer::Done(Err(refusal)),
                }
            }
            message => Answer::Done(request(&message, [received.micros, micros], guard, settings, safety, update)?),
        };
        if is_arm && matches!(answer, Answer::Done(Ok(()))) {
            self.bound(true);
        }
        let message = match answer {
            Answer::Message(message) => message,
            Answer::Report(report) => self.report_message(report, safety),
            #[cfg(feature = "prefix")]
            Answer::Done(outcome) if is_prefix => {
                let written = update.with_prefix(|transfer| transfer.written()).unwrap_or(0);
                Message::Ack { of, refusal: outcome.err(), written }
            }
            Answer::Done(outcome) => Message::Ack { of, refusal: outcome.err(), written: update.written() },
        };
        self.sender.frame(&message, micros, out)
    }

    /// Returns a status if one is due or the token changed. Call it at least every few ticks: it also detects a silent
    /// line.
    pub fn report<'b, const AXES: usize>(
        &mut self,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        self.relearn(safety);
        let (ticks, token) = safety.with(|safety| (safety.ticks(), safety.token()));
        let period = self.settings.status_period;
        let is_due = period > 0 && ticks.wrapping_sub(self.reported_at) >= period;
        if !is_due && self.reported_token == Some(token) {
            return None;
        }
        self.reported_at = ticks;
        let status = self.report_message(Report::Status, safety);
        self.sender.frame(&status, micros, out)
    }

    /// While not armed: resets the clock tracking if no valid observation arrived in time, and the sequence numbers if
    /// no good frame arrived for [`Settings::quiet`] ticks. An earlier frame could then be accepted again, so the token
    /// is renewed.
    fn relearn<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        let (ticks, stale, state) = safety.with(|safety| (safety.ticks(), safety.is_stale(), safety.state()));
        if state == State::Armed {
            return;
        }
        self.bound(false);
        let is_quiet = ticks.wrapping_sub(self.heard_at) > self.settings.quiet;
        if stale || is_quiet {
            self.guard.reopen();
        }
        if is_quiet {
            self.heard_at = ticks;
            if self.receiver.reopen() {
                safety.with(Safety::renew);
            }
        }
    }

    /// While armed, only frames that follow the arm request, by their numbers and their times, are accepted.
    fn bound(&mut self, is_armed: bool) {
        self.receiver.bound(is_armed);
        self.guard.bound(is_armed);
    }

    /// Returns the newest observation once, if it arrived under the current token and a status has reported this token.
    /// While not armed, the head's actions are reported and not applied.
    pub fn step<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) -> Option<Step<'_>> {
        let token = Some(safety.with(|safety| safety.token()));
        if self.reported_token != token {
            return None;
        }
        let (of, observation) = self.guard.newest()?;
        if self.observed_token != token {
            return None;
        }
        let reset = mem::replace(&mut self.step_token, token) != token;
        Some(Step { of, reset, observation })
    }

    /// Takes the head's action on the last [`Self::step`], or its failure; returns the frame to send. An action is
    /// dropped if the token changed since the step began; a failure always latches.
    pub fn acted<'b, E, const AXES: usize>(
        &mut self,
        of: u32,
        action: Result<&[f32], E>,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let Ok(action) = action else {
            safety.with(|safety| safety.trip(Fault::Head));
            let status = self.report_message(Report::Status, safety);
            return self.sender.frame(&status, micros, out);
        };
        let token = self.step_token;
        let applied = safety.with(|safety| (token == Some(safety.token())).then(|| safety.act(action)))?;
        let message = match &applied {
            Ok(Some(target)) => Message::Action { of, applied: true, values: Floats::Values(target) },
            Ok(None) => Message::Action { of, applied: false, values: Floats::Values(action) },
            Err(_) => self.report_message(Report::Status, safety),
        };
        self.sender.frame(&message, micros, out)
    }

    fn report_message<const AXES: usize>(
        &mut self,
        report: Report,
        safety: &mut impl Shared<AXES>,
    ) -> Message<'static> {
        match report {
            Report::Timing => Message::Timing(self.facts.timing),
            Report::Breadcrumb => Message::Breadcrumb(self.facts.breadcrumb),
            Report::Status => {
                let (state, fault, refusal, token, ticks) = safety
                    .with(|safety| (safety.state(), safety.fault(), safety.refusal(), safety.token(), safety.ticks()));
                self.reported_token = Some(token);
                Message::Status(Status {
                    state,
                    fault,
                    refusal,
                    reset: self.facts.breadcrumb.reset,
                    token,
                    ticks,
                    image: self.facts.image,
                    slot: self.facts.slot,
                    axes: u8::try_from(AXES).unwrap_or(u8::MAX),
                    observation: u16::try_from(self.guard.values()).unwrap_or(u16::MAX),
                    payload: u16::try_from(Receiver::<N>::PAYLOAD).unwrap_or(u16::MAX),
                    refused: self.guard.refused(),
                    counters: self.receiver.counters(),
                })
            }
        }
    }
}

/// Answer to a message.
enum Answer {
    Message(Message<'static>),
    Report(Report),
    /// An acknowledgement.
    Done(Result<(), Refusal>),
}
