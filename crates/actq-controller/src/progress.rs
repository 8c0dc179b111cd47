//! Decides when to feed the watchdog.
//!
//! The link makes progress when its bytes are read, even if there are none: a broken cable needs the safe action, which
//! a reset would end. The head makes progress with a piece of a step, or if it has none to do. The output makes
//! progress with a control tick.

/// Parts that have made progress since the last feeding of the watchdog.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The link's bytes were read.
    pub link: bool,
    /// The head did a piece of its step, or had none to do.
    pub head: bool,
    /// The outputs were written.
    pub output: bool,
}

impl Progress {
    /// Returns `true` to feed the watchdog: all parts have made progress. Then starts over.
    #[must_use]
    pub fn feed(&mut self) -> bool {
        let all = self.link && self.head && self.output;
        if all {
            *self = Self::default();
        }
        all
    }

    /// Returns the parts without progress, for the breadcrumb of the watchdog's early interrupt: link 1, head 2, output
    /// 4.
    pub const fn missing(&self) -> u32 {
        !self.link as u32 | (!self.head as u32) << 1 | (!self.output as u32) << 2
    }
}
