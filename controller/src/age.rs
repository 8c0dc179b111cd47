//! How old an observation is, by two clocks that nobody has set.
//!
//! The difference of the receiver's and the sender's clock, less the smallest one seen, is what a frame took longer
//! than the fastest. The smallest one rises with time, as fast as the sender's clock may run slow: a crystal is right
//! to 0.01 %, an RC oscillator to 3 %. So no rate has to be learnt, and of each frame let through before, whichever it
//! was: an age is at least what the frame took longer than that one, less [`DRIFT_BITS`]' share of the time since, and
//! less what the sender's clock runs fast. A sender whose time stops or jumps back grows old; one whose time jumps
//! forward is from then on the new time.

/// The smallest difference rises by 1 in 2^5 of the time: 3.1 %.
const DRIFT_BITS: u32 = 5;

/// Follows the difference of two clocks in µs, both of which wrap.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Age {
    least: Option<Least>,
}

#[derive(Clone, Copy, Debug)]
struct Least {
    /// Local time less remote time.
    difference: u32,
    /// Local time up to which the drift is in it.
    since: u32,
}

impl Age {
    /// Age in µs of what was sent at `remote` and came at `local`, against the fastest delivery. Right up to half an
    /// hour.
    pub(crate) fn of(&mut self, remote: u32, local: u32) -> u32 {
        let difference = local.wrapping_sub(remote);
        let least = self.least.get_or_insert(Least { difference, since: local });
        let drift = local.wrapping_sub(least.since) >> DRIFT_BITS;
        least.difference = least.difference.wrapping_add(drift);
        least.since = least.since.wrapping_add(drift << DRIFT_BITS);
        let age = difference.wrapping_sub(least.difference);
        if age >= 1 << 31 {
            least.difference = difference;
            return 0;
        }
        age
    }
}
