//! The transfer of a prefix: keys and values of a large model on the host, in pieces, while the head may use the prefix
//! before it.

use actq_link::code::Refusal;
use actq_link::frame::CRC;
use crc::Digest;

/// Announcement of a prefix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// CRC-32 in the header of the image that reads it.
    pub image: u32,
    /// Length in bytes.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of all bytes.
    pub crc: u32,
    /// Ticks from the announcement's arrival, at least 1, for which the prefix may be used.
    pub lifetime: u32,
}

/// Takes the bytes of a prefix beside the one in use, and knows for how long each may be used.
///
/// [`Self::whole`] returns a complete one: pass it to the head between two evaluations, and the outcome to
/// [`Self::installed`]. Call [`Self::is_fresh`] at least once per tick, and clear the head's prefix when it is `false`.
pub struct Transfer<'b> {
    memory: &'b mut [u8],
    /// CRC-32 in the header of the running image.
    image: u32,
    /// The longest lifetime that is accepted, in ticks.
    max_lifetime: u32,
    phase: Phase,
    /// Arrival of the prefix in use, and its lifetime.
    used: Option<[u32; 2]>,
}

enum Phase {
    /// No prefix was announced.
    Idle,
    /// Waiting for bytes: this number of them came, since this tick.
    Receiving { plan: Plan, since: u32, taken: u32, digest: Digest<'static, u32> },
    /// All bytes are here and wait for the head.
    Whole { plan: Plan, since: u32 },
    /// The head has it, or it was refused.
    Done { plan: Plan, outcome: Result<(), Refusal> },
}

impl<'b> Transfer<'b> {
    /// Creates a transfer for the running image, with this CRC-32 in its header, into memory of exactly its prefix's bytes.
    pub const fn new(memory: &'b mut [u8], image: u32, max_lifetime: u32) -> Self {
        Self { memory, image, max_lifetime, phase: Phase::Idle, used: None }
    }

    /// Takes an announcement at tick `now`. One that is repeated before the first byte keeps the time of its first arrival.
    ///
    /// # Errors
    ///
    /// [`Refusal::Unsupported`] if the image has no prefix, [`Refusal::Unfit`] for another image, [`Refusal::Length`] for
    /// another length, [`Refusal::Range`] for a lifetime of 0 or above the longest.
    pub fn begin(&mut self, plan: Plan, now: u32) -> Result<(), Refusal> {
        if self.memory.is_empty() {
            return Err(Refusal::Unsupported);
        }
        if plan.image != self.image {
            return Err(Refusal::Unfit);
        }
        if plan.length as usize != self.memory.len() {
            return Err(Refusal::Length);
        }
        if !(1..=self.max_lifetime).contains(&plan.lifetime) {
            return Err(Refusal::Range);
        }
        match &self.phase {
            Phase::Receiving { plan: old, taken: 0, .. } if *old == plan => {}
            _ => self.phase = Phase::Receiving { plan, since: now, taken: 0, digest: CRC.digest() },
        }
        Ok(())
    }

    /// Takes the next bytes; those that came before change nothing.
    ///
    /// # Errors
    ///
    /// [`Refusal::NoUpdate`] without an announcement, [`Refusal::Length`] after the end, [`Refusal::Offset`] for bytes that
    /// are ahead.
    pub fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let (plan, taken) = (self.plan().ok_or(Refusal::NoUpdate)?, self.written());
        let end = u32::try_from(bytes.len()).ok().and_then(|len| offset.checked_add(len)).ok_or(Refusal::Length)?;
        if end > plan.length {
            return Err(Refusal::Length);
        }
        if end <= taken {
            return Ok(());
        }
        let Phase::Receiving { taken, digest, .. } = &mut self.phase else { return Ok(()) };
        if offset != *taken {
            return Err(Refusal::Offset);
        }
        let place = self.memory.get_mut(offset as usize..end as usize).ok_or(Refusal::Length)?;
        place.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte);
        digest.update(bytes);
        *taken = end;
        Ok(())
    }

    /// Ends the transfer: the head gets the prefix before its next evaluation.
    ///
    /// # Errors
    ///
    /// [`Refusal::Busy`] until the head has it: repeat the request. [`Refusal::NoUpdate`] without an announcement,
    /// [`Refusal::Length`] before the last byte, [`Refusal::Checksum`], and the head's refusal.
    pub fn commit(&mut self) -> Result<(), Refusal> {
        match &self.phase {
            Phase::Idle => Err(Refusal::NoUpdate),
            Phase::Receiving { plan, taken, .. } if *taken < plan.length => Err(Refusal::Length),
            Phase::Receiving { plan, since, digest, .. } => {
                let (plan, since) = (*plan, *since);
                if digest.clone().finalize() != plan.crc {
                    self.phase = Phase::Done { plan, outcome: Err(Refusal::Checksum) };
                    return Err(Refusal::Checksum);
                }
                self.phase = Phase::Whole { plan, since };
                Err(Refusal::Busy)
            }
            Phase::Whole { .. } => Err(Refusal::Busy),
            Phase::Done { outcome, .. } => *outcome,
        }
    }

    /// Returns the accepted bytes of the transfer.
    pub fn written(&self) -> u32 {
        match &self.phase {
            Phase::Idle => 0,
            Phase::Receiving { taken, .. } => *taken,
            Phase::Whole { plan, .. } | Phase::Done { plan, .. } => plan.length,
        }
    }

    fn plan(&self) -> Option<Plan> {
        match &self.phase {
            Phase::Idle => None,
            Phase::Receiving { plan, .. } | Phase::Whole { plan, .. } | Phase::Done { plan, .. } => Some(*plan),
        }
    }

    /// Returns a complete prefix that the head does not have yet.
    pub fn whole(&self) -> Option<&[u8]> {
        match &self.phase {
            Phase::Whole { .. } => Some(self.memory),
            _ => None,
        }
    }

    /// Records that the head has taken [`Self::whole`], or why not; then it keeps the one before.
    pub fn installed(&mut self, outcome: Result<(), Refusal>) {
        if let Phase::Whole { plan, since } = self.phase {
            if outcome.is_ok() {
                self.used = Some([since, plan.lifetime]);
            }
            self.phase = Phase::Done { plan, outcome };
        }
    }

    /// Returns `true` at tick `now` if the prefix in use may still be used, or if the image has none.
    pub fn is_fresh(&mut self, now: u32) -> bool {
        // Once over, it stays so, also when the ticks wrap.
        self.used = self.used.filter(|[since, lifetime]| now.wrapping_sub(*since) <= *lifetime);
        self.memory.is_empty() || self.used.is_some()
    }
}
