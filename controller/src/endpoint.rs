//! The controller's end of the link: what each message does, and what is answered.
//!
//! The firmware calls [`Endpoint::receive`] for every byte that came, [`Endpoint::report`] every now and then, and
//! sends what they give. It lets the head run on [`Endpoint::step`] and hands its action to [`Endpoint::acted`].
//!
//! An observation, its step and its action belong to the token ([`Safety::token`]) that the observation came under:
//! with another token they are dropped, and the head begins anew. So a host that reads each token, which a status tells
//! before the first action under it, can predict every action.

use core::mem;

use actq_link::code::{Fault, Parameter, Refusal, Report, State};
use actq_link::report::{Breadcrumb, Status, Timing};
use actq_link::{Floats, Message, Receiver, Sender};

use crate::guard::Guard;
use crate::requests::{Settings, request};
use crate::safety::{Safety, Shared};
use crate::update::Update;

/// Ticks without a good frame, while not armed, after which a host may have started anew and is listened to from any
/// number on.
pub const QUIET: u32 = 1000;

/// What a controller tells of itself, besides what it decides.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// CRC-32 in the header of the image that runs; 0 without one.
    pub image: u32,
    /// Its slot, 0 or 1, or [`actq_link::report::BUILT_IN`].
    pub slot: u8,
    /// How long things take.
    pub timing: Timing,
    /// What was left behind before the last reset, and its cause.
    pub breadcrumb: Breadcrumb,
}

/// An observation for the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<'a> {
    /// Sequence number of its frame.
    pub of: u32,
    /// `true` if the head has to be reset first: the token differs from that of the step before.
    pub reset: bool,
    /// Its values.
    pub observation: &'a [f32],
}

/// The controller's end of the link. `OBS` is room for an observation's values, `N` for a frame
/// ([`actq_link::frame::bytes`]).
#[derive(Debug)]
pub struct Endpoint<'r, const OBS: usize, const N: usize> {
    receiver: Receiver<N>,
    sender: Sender,
    guard: Guard<'r, OBS>,
    /// To be kept up to date by the firmware.
    pub facts: Facts,
    settings: Settings,
    /// Tick of the last one.
    reported: u32,
    /// Tick of the last good frame.
    heard: u32,
    /// [`Safety::token`] in the last status.
    told_token: Option<u32>,
    /// When the newest observation came.
    observed_token: Option<u32>,
    /// When the last step was given.
    step_token: Option<u32>,
}

impl<'r, const OBS: usize, const N: usize> Endpoint<'r, OBS, N> {
    /// An end that has heard nothing yet.
    pub const fn new(guard: Guard<'r, OBS>, facts: Facts, settings: Settings) -> Self {
        let receiver = Receiver::new();
        let sender = Sender::new(0);
        let [told_token, observed_token, step_token] = [None; 3];
        Self { receiver, sender, guard, facts, settings, reported: 0, heard: 0, told_token, observed_token, step_token }
    }

    /// Takes a byte that came at `micros`; the frame to send for it, in `out`.
    ///
    /// `out` needs room for [`actq_link::frame::wire_bytes`] of 46 bytes and of an action; a frame without room is not
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
        self.heard = safety.with(|safety| safety.ticks());
        let of = received.sequence;
        let (guard, settings) = (&mut self.guard, &mut self.settings);
        let answer = match received.message {
            Message::Observation(values) => {
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
            message => Answer::Done(request(&message, guard, settings, safety, update)?),
        };
        let message = match answer {
            Answer::Message(message) => message,
            Answer::Report(report) => self.of_report(report, safety),
            Answer::Done(outcome) => Message::Ack { of, refusal: outcome.err(), written: update.written() },
        };
        self.sender.frame(&message, micros, out)
    }

    /// A status, where one is due, or the token is another one. To be called at least every few ticks: it also notices
    /// that the line has fallen silent.
    pub fn report<'b, const AXES: usize>(
        &mut self,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        self.relearn(safety);
        let (ticks, token) = safety.with(|safety| (safety.ticks(), safety.token()));
        let period = self.settings.status_period;
        let is_due = period > 0 && ticks.wrapping_sub(self.reported) >= period;
        if !is_due && self.told_token == Some(token) {
            return None;
        }
        self.reported = ticks;
        let status = self.of_report(Report::Status, safety);
        self.sender.frame(&status, micros, out)
    }

    /// While not armed: learns the clocks anew where no good observation has come in time, and the numbers, too, where
    /// nothing has for long. What has come under the numbers before may then come once more: its token counts no more.
    fn relearn<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        let (ticks, stale, state) = safety.with(|safety| (safety.ticks(), safety.is_stale(), safety.state()));
        if state == State::Armed {
            return;
        }
        let is_quiet = ticks.wrapping_sub(self.heard) > QUIET;
        if stale || is_quiet {
            self.guard.reopen();
        }
        if is_quiet {
            self.heard = ticks;
            if self.receiver.reopen() {
                safety.with(Safety::renew);
            }
        }
    }

    /// The newest observation, once, where it has come under the token of now; not before a status has told that. While
    /// not armed, too: the head's actions are then told and not applied.
    pub fn step<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) -> Option<Step<'_>> {
        let token = Some(safety.with(|safety| safety.token()));
        if self.told_token != token {
            return None;
        }
        let (of, observation) = self.guard.newest()?;
        if self.observed_token != token {
            return None;
        }
        let reset = mem::replace(&mut self.step_token, token) != token;
        Some(Step { of, reset, observation })
    }

    /// Takes the head's action on the last [`Self::step`], or its failure; the frame to send. An action is dropped where
    /// the token has changed since the step began; a failure latches all the same.
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
            let status = self.of_report(Report::Status, safety);
            return self.sender.frame(&status, micros, out);
        };
        let token = self.step_token;
        let applied = safety.with(|safety| (token == Some(safety.token())).then(|| safety.act(action)))?;
        let message = match &applied {
            Ok(Some(target)) => Message::Action { of, applied: true, values: Floats::Values(target) },
            Ok(None) => Message::Action { of, applied: false, values: Floats::Values(action) },
            Err(_) => self.of_report(Report::Status, safety),
        };
        self.sender.frame(&message, micros, out)
    }

    fn of_report<const AXES: usize>(&mut self, report: Report, safety: &mut impl Shared<AXES>) -> Message<'static> {
        match report {
            Report::Timing => Message::Timing(self.facts.timing),
            Report::Breadcrumb => Message::Breadcrumb(self.facts.breadcrumb),
            Report::Status => {
                let (state, fault, refusal, token, ticks) = safety
                    .with(|safety| (safety.state(), safety.fault(), safety.refusal(), safety.token(), safety.ticks()));
                self.told_token = Some(token);
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

/// What a message is answered with.
enum Answer {
    Message(Message<'static>),
    Report(Report),
    /// An acknowledgement.
    Done(Result<(), Refusal>),
}
