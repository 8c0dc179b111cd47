//! The order of frames: separates new ones from repeated or late ones.

/// Order of a frame relative to earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// A new frame.
    New {
        /// Frames lost between the last one and this one.
        lost: u32,
    },
    /// This frame, or a later one, arrived before; or it is too far ahead.
    Repeated,
}

/// The numbers ahead that count as new: half of all.
pub(crate) const HALF: u32 = (1 << 31) - 1;

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

    /// Accepts a new frame, at most `reach` ahead of the last one.
    pub(crate) fn admit(&mut self, sequence: u32, reach: u32) -> Order {
        let ahead = self.last.map_or(1, |last| sequence.wrapping_sub(last));
        if ahead == 0 || ahead > reach {
            return Order::Repeated;
        }
        self.last = Some(sequence);
        Order::New { lost: ahead - 1 }
    }
}
