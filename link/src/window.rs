//! The order of frames: separates new ones from repeated or late ones.

/// Order of a frame relative to earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// A new frame.
    New {
        /// Frames lost between the last one and this one.
        lost: u32,
    },
    /// This frame, or a later one, arrived before.
    Repeated,
}

/// The last accepted sequence number. Numbers wrap; half of them count as new (RFC 1982), which at 1 kHz is 24 days.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    last: Option<u32>,
}

impl Window {
    pub(crate) const fn open() -> Self {
        Self { last: None }
    }

    /// Opens the window; returns `true` if it was not open.
    pub(crate) fn reopen(&mut self) -> bool {
        self.last.take().is_some()
    }

    /// Accepts a new frame.
    pub(crate) fn admit(&mut self, sequence: u32) -> Order {
        let ahead = self.last.map_or(1, |last| sequence.wrapping_sub(last));
        if ahead == 0 || ahead >= 1 << 31 {
            return Order::Repeated;
        }
        self.last = Some(sequence);
        Order::New { lost: ahead - 1 }
    }
}
