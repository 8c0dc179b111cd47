//! Power that fails in the course of a change to a memory.

use crate::random::Random;

/// The extent of a change to a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The change is complete.
    Whole,
    /// Power fails in its course.
    Part,
    /// Power has failed before.
    Nothing,
}

/// The power supply of a memory.
#[derive(Clone, Debug)]
pub struct Power {
    /// Changes begun so far.
    pub done: usize,
    /// The change in whose course power fails.
    pub fails_at: Option<usize>,
    random: Random,
}

impl Power {
    /// Creates a supply that does not fail; `random` draws the bits of a partial change.
    pub fn new(random: Random) -> Self {
        Self { done: 0, fails_at: None, random }
    }

    /// Restores power; it fails in the course of change `fails_at`, if any.
    pub fn restart(&mut self, fails_at: Option<usize>) {
        (self.done, self.fails_at) = (0, fails_at);
    }

    /// Begins a change.
    pub fn change(&mut self) -> Change {
        let change = match self.fails_at {
            Some(at) if self.done == at => Change::Part,
            Some(at) if self.done > at => return Change::Nothing,
            _ => Change::Whole,
        };
        self.done += 1;
        change
    }

    /// `true` once power has failed.
    pub fn is_off(&self) -> bool {
        self.fails_at.is_some_and(|at| self.done > at)
    }

    /// Draws, for each byte of an interrupted erase, the bits that are ones already: few, about half, or almost all.
    pub fn erased(&mut self) -> impl Iterator<Item = u8> {
        let share = self.random.below(3);
        std::iter::repeat_with(move || {
            let [a, b, c] = [(); 3].map(|()| self.random.byte());
            [a & b & c, a, a | b][share]
        })
    }

    /// Draws the bits of a byte that an interrupted write leaves as they were.
    pub fn kept(&mut self) -> u8 {
        self.random.byte()
    }
}
