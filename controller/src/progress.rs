//! When the watchdog is fed.
//!
//! Progress of the link is that its bytes are looked at, not that there are any: what a cut cable needs is the safe
//! action, which a reset would end. Progress of the head is a piece of a step, or that there is none to do; that of the
//! output a control tick.

/// What has made progress since the watchdog was last fed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The link's bytes were looked at.
    pub link: bool,
    /// The head has done a piece of its step, or has none to do.
    pub head: bool,
    /// The outputs were told.
    pub output: bool,
}

impl Progress {
    /// Whether to feed the watchdog now: all have made progress. It begins anew then.
    #[must_use]
    pub fn feed(&mut self) -> bool {
        let all = self.link && self.head && self.output;
        if all {
            *self = Self::default();
        }
        all
    }

    /// What has not, for the breadcrumb that a watchdog's early interrupt leaves: link 1, head 2, output 4.
    pub const fn missing(&self) -> u32 {
        !self.link as u32 | (!self.head as u32) << 1 | (!self.output as u32) << 2
    }
}
