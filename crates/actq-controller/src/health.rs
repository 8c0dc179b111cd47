//! Checks that must pass before any output moves.

use actq_link::code::{Fault, Refusal};

/// A check that must pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// The image's checksum, at the start and by the scrub while running.
    Image,
    /// The image's self-test vector, bit for bit.
    SelfTest,
    /// The clock runs at its rate.
    Clock,
    /// The watchdog runs.
    Watchdog,
    /// The break input is not active, and the outputs are as they should be.
    Hardware,
    /// The head has the prefix that its image reads, within its lifetime. An image without a prefix needs no check.
    #[cfg(feature = "prefix")]
    Prefix,
}

impl Check {
    /// All checks, in the order in which refusals name them.
    #[cfg(not(feature = "prefix"))]
    pub const ALL: [Self; 5] = [Self::Image, Self::SelfTest, Self::Clock, Self::Watchdog, Self::Hardware];
    /// All checks, in the order in which refusals name them.
    #[cfg(feature = "prefix")]
    pub const ALL: [Self; 6] = [Self::Image, Self::SelfTest, Self::Clock, Self::Watchdog, Self::Hardware, Self::Prefix];

    /// Returns the refusal to arm while this check fails.
    const fn refusal(self) -> Refusal {
        match self {
            Self::Image => Refusal::Image,
            Self::SelfTest => Refusal::SelfTest,
            Self::Clock => Refusal::Clock,
            Self::Watchdog => Refusal::Watchdog,
            Self::Hardware => Refusal::Hardware,
            #[cfg(feature = "prefix")]
            Self::Prefix => Refusal::Prefix,
        }
    }

    /// Returns the fault of an armed controller when this check fails.
    pub(crate) const fn fault(self) -> Fault {
        match self {
            Self::Image | Self::SelfTest => Fault::Image,
            Self::Clock => Fault::Clock,
            Self::Watchdog => Fault::Watchdog,
            Self::Hardware => Fault::Break,
            #[cfg(feature = "prefix")]
            Self::Prefix => Fault::Prefix,
        }
    }
}

/// Outcomes of all checks. A check that was not made counts as failed, except that of a prefix.
#[derive(Clone, Copy, Debug)]
pub struct Health {
    passed: [bool; Check::ALL.len()],
}

impl Default for Health {
    fn default() -> Self {
        #[cfg(feature = "prefix")]
        let passed = Check::ALL.map(|check| check == Check::Prefix);
        #[cfg(not(feature = "prefix"))]
        let passed = [false; Check::ALL.len()];
        Self { passed }
    }
}

impl Health {
    /// Records the outcome of a check.
    pub fn set(&mut self, check: Check, passed: bool) {
        for (slot, which) in self.passed.iter_mut().zip(Check::ALL) {
            if which == check {
                *slot = passed;
            }
        }
    }

    /// Returns `true` if a check has passed.
    pub(crate) fn has_passed(&self, check: Check) -> bool {
        self.passed.iter().zip(Check::ALL).any(|(passed, which)| *passed && which == check)
    }

    /// Returns the outcomes as bits, for a checksum.
    pub(crate) fn bits(&self) -> u8 {
        self.passed.iter().fold(0, |bits, passed| bits << 1 | u8::from(*passed))
    }

    /// Returns the permission to arm.
    ///
    /// # Errors
    ///
    /// Returns the refusal for the first check that failed or was not made.
    pub fn ready(&self) -> Result<Ready, Refusal> {
        match self.passed.iter().zip(Check::ALL).find(|(passed, _)| !**passed) {
            None => Ok(Ready(())),
            Some((_, check)) => Err(check.refusal()),
        }
    }
}

/// Proof that all checks passed. Only [`Health::ready`] creates it, and arming requires it.
#[derive(Debug)]
pub struct Ready(());
