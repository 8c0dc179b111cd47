//! The order of frames: what is repeated or late is told from what is new.

/// How a frame stands to those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// It is new; so many were lost before it.
    New {
        /// Frames between the last one and this.
        lost: u32,
    },
    /// It, or one behind it, was here already.
    Repeated,
}

/// The last sequence number that was let through. Numbers wrap; half of them count as new (RFC 1982): at 1 kHz those of
/// 24 days.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    last: Option<u32>,
}

impl Window {
    pub(crate) const fn open() -> Self {
        Self { last: None }
    }

    /// Opens it; `true` if it was not open.
    pub(crate) fn reopen(&mut self) -> bool {
        self.last.take().is_some()
    }

    /// Lets a new frame through.
    pub(crate) fn admit(&mut self, sequence: u32) -> Order {
        let ahead = self.last.map_or(1, |last| sequence.wrapping_sub(last));
        if ahead == 0 || ahead >= 1 << 31 {
            return Order::Repeated;
        }
        self.last = Some(sequence);
        Order::New { lost: ahead - 1 }
    }
}
