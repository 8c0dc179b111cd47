//! The requests that are acknowledged.

use actq_link::Message;
use actq_link::code::{Parameter, Refusal, State};

use crate::guard::Guard;
use crate::parameters::whole;
#[cfg(feature = "prefix")]
use crate::prefix::{self, Transfer};
use crate::safety::{Safety, Shared};
use crate::update::{Plan, Update};

/// Settings of the endpoint.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Ticks between two status reports. With 0, the only unrequested report is that of a new token.
    pub status_period: u32,
    /// `true` if flash can be erased and written while the outputs are driven: code is not fetched from the same bank.
    pub flash_while_armed: bool,
    /// Ticks without a good frame, while not armed, after which any sequence number is accepted, because the host may
    /// have restarted: those of a second.
    pub quiet: u32,
}

impl Settings {
    /// Checks that flash may be written now. If writing stops the tick, a tick must first have switched the power stage
    /// off.
    fn may_write<const AXES: usize>(&self, safety: &mut impl Shared<AXES>) -> Result<(), Refusal> {
        if self.flash_while_armed { Ok(()) } else { safety.with(|safety| safety.may_stall()) }
    }
}

/// Carries out a request that was sent at `sent` µs and came at `came` µs; `None` for a message that only a controller
/// sends.
pub(crate) fn request<const OBS: usize, const AXES: usize>(
    message: &Message<'_>,
    [sent, came]: [u32; 2],
    guard: &mut Guard<'_, OBS>,
    settings: &mut Settings,
    safety: &mut impl Shared<AXES>,
    update: &mut impl Update,
) -> Option<Result<(), Refusal>> {
    let outcome = match *message {
        Message::Arm { .. } if update.is_busy() => Err(Refusal::Busy),
        // A request with the token was sent by the host of now, so its time is right, and the clocks follow it: an old
        // one was held up, or the clocks were learned from recorded frames. Other reasons come first.
        Message::Arm { token } => safety.with(|safety| {
            let is_old = token == safety.token() && guard.date(sent, came).is_err();
            if is_old && safety.refusal().is_none() { Err(Refusal::Stale) } else { safety.arm(token) }
        }),
        Message::Disarm => {
            safety.with(Safety::disarm);
            Ok(())
        }
        Message::Set { token, parameter: Parameter::MaxAge, value, .. } => {
            safety.with(|safety| safety.may_change(token)).and_then(|()| guard.set_max_age(whole(value, 0, u32::MAX)?))
        }
        Message::Set { token, parameter: Parameter::StatusPeriod, value, .. } => {
            let period = safety.with(|safety| safety.may_change(token)).and_then(|()| whole(value, 0, u32::MAX));
            period.map(|period| settings.status_period = period)
        }
        Message::Set { token, parameter, axis, value } => {
            safety.with(|safety| safety.set(token, parameter, axis, value))
        }
        Message::Begin { token, length, crc, version } => {
            let may = safety.with(|safety| match safety.may_change(token) {
                Err(Refusal::Armed) if settings.flash_while_armed => Ok(()),
                other => other,
            });
            may.and_then(|()| settings.may_write(safety)).and_then(|()| update.begin(Plan { length, crc, version }))
        }
        Message::Chunk { offset, bytes } => settings.may_write(safety).and_then(|()| update.chunk(offset, bytes)),
        // The test of an image takes the head and holds up the loop, which then reads no disarm.
        Message::Commit { .. } if safety.with(|safety| safety.state()) != State::Disarmed => Err(Refusal::Armed),
        Message::Commit { signature } => settings.may_write(safety).and_then(|()| update.commit(signature)),
        Message::Abort => update.abort(),
        // In every state. Of an old request, nobody knows for how long the prefix may still be used.
        #[cfg(feature = "prefix")]
        Message::BeginPrefix { token, image, length, crc, lifetime } => {
            let (may, now) = safety.with(|safety| (safety.may_change(token), safety.ticks()));
            let plan = prefix::Plan { image, length, crc, lifetime };
            match may {
                Err(Refusal::Token) => Err(Refusal::Token),
                _ if guard.date(sent, came).is_err() => Err(Refusal::Stale),
                _ => of_prefix(update, |transfer| transfer.begin(plan, now)),
            }
        }
        #[cfg(feature = "prefix")]
        Message::PrefixChunk { offset, bytes } => of_prefix(update, |transfer| transfer.chunk(offset, bytes)),
        #[cfg(feature = "prefix")]
        Message::CommitPrefix => of_prefix(update, |transfer| transfer.commit()),
        _ => return None,
    };
    Some(outcome)
}

/// Carries out a request of a prefix.
#[cfg(feature = "prefix")]
fn of_prefix(
    update: &mut impl Update,
    run: impl FnOnce(&mut Transfer<'_>) -> Result<(), Refusal>,
) -> Result<(), Refusal> {
    update.with_prefix(run).unwrap_or(Err(Refusal::Unsupported))
}
