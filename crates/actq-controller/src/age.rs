//! Age of an observation, measured by two clocks that are not synchronized.
//!
//! The receiver's time minus the sender's time, minus the smallest such difference seen, is how much longer a frame
//! took than the fastest one. The smallest difference rises with time, as fast as the sender's clock may run slow: a
//! crystal is accurate to 0.01 %, an RC oscillator to 3 %. So the clocks' rates need not be estimated. Compare a frame
//! with any earlier accepted one. Its age is at least its extra delay, minus [`DRIFT_BITS`]' share of the time between
//! them, minus the gain of a fast sender's clock. If the sender's time stops or jumps back, its observations become
//! old. If it jumps forward, the age is relative to the new time from then on; an armed controller refuses that.

/// The smallest difference rises by 1/2^5 of the time: 3.1 %.
const DRIFT_BITS: u32 = 5;

/// Most time in µs by which a frame may be faster than the fastest one before it while the controller is armed: more
/// than a queue holds up a frame that is not refused. A frame of another run of the sender is likely to be outside.
const LEAP: u32 = 1 << 20;

/// Tracks the difference of two clocks in µs, both of which wrap.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Age {
    least: Option<Least>,
}

#[derive(Clone, Copy, Debug)]
struct Least {
    /// Local time minus remote time.
    difference: u32,
    /// Local time up to which the drift is included.
    since: u32,
}

impl Age {
    /// Returns the age in µs of a message sent at `remote` and received at `local`, relative to the fastest delivery.
    /// Correct up to half an hour. `None` if the sender's time jumped forward by more than [`LEAP`] and `may_leap` is
    /// false: then nothing changes.
    pub(crate) fn of(&mut self, remote: u32, local: u32, may_leap: bool) -> Option<u32> {
        let difference = local.wrapping_sub(remote);
        let least = self.least.get_or_insert(Least { difference, since: local });
        let drift = local.wrapping_sub(least.since) >> DRIFT_BITS;
        least.difference = least.difference.wrapping_add(drift);
        least.since = least.since.wrapping_add(drift << DRIFT_BITS);
        let age = difference.wrapping_sub(least.difference);
        if age < 1 << 31 {
            return Some(age);
        }
        if !may_leap && age.wrapping_neg() > LEAP {
            return None;
        }
        least.difference = difference;
        Some(0)
    }
}
