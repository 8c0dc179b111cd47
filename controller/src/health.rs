//! What has to be right before anything moves.

use actq_link::code::{Fault, Refusal};

/// One of the things that have to be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// The image's checksum: at the start, and by the scrub while running.
    Image,
    /// The image's self-test vector, bit for bit.
    SelfTest,
    /// The clock runs at its rate.
    Clock,
    /// The watchdog runs.
    Watchdog,
    /// No break input, no overrun since it was last cleared.
    Hardware,
}

impl Check {
    /// All of them, in the order in which refusals name them.
    pub const ALL: [Self; 5] = [Self::Image, Self::SelfTest, Self::Clock, Self::Watchdog, Self::Hardware];

    /// Why it keeps from arming.
    const fn refusal(self) -> Refusal {
        match self {
            Self::Image => Refusal::Image,
            Self::SelfTest => Refusal::SelfTest,
            Self::Clock => Refusal::Clock,
            Self::Watchdog => Refusal::Watchdog,
            Self::Hardware => Refusal::Hardware,
        }
    }

    /// What it does to a controller that is armed.
    pub(crate) const fn fault(self) -> Fault {
        match self {
            Self::Image | Self::SelfTest => Fault::Image,
            Self::Clock => Fault::Clock,
            Self::Watchdog => Fault::Watchdog,
            Self::Hardware => Fault::Break,
        }
    }
}

/// What is known to be right. Nothing is, until it was said.
#[derive(Clone, Copy, Debug, Default)]
pub struct Health {
    passed: [bool; Check::ALL.len()],
}

impl Health {
    /// Notes the outcome of a check.
    pub fn set(&mut self, check: Check, passed: bool) {
        for (slot, which) in self.passed.iter_mut().zip(Check::ALL) {
            if which == check {
                *slot = passed;
            }
        }
    }

    /// The permission to arm.
    ///
    /// # Errors
    ///
    /// What has failed or was not done, the first of several.
    pub fn ready(&self) -> Result<Ready, Refusal> {
        match self.passed.iter().zip(Check::ALL).find(|(passed, _)| !**passed) {
            None => Ok(Ready(())),
            Some((_, check)) => Err(check.refusal()),
        }
    }
}

/// Every check has passed. Only [`Health::ready`] gives it, and nothing is armed without it.
#[derive(Debug)]
pub struct Ready(());
