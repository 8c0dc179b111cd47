//! How long the independent watchdog waits (RM0090, section 21): its ticks are those of an oscillator of its own,
//! divided by 32. That has 32 kHz, in truth 17 to 47 (data sheet DS8626), so that a tick is a millisecond, or 0.68 to
//! 1.9.

/// The oscillator's fastest, in kHz.
const FASTEST: u32 = 47;
/// What it is divided by.
const DIVIDER: u32 = 32;

/// The most ticks that there are.
pub const LONGEST: u16 = 4096;

/// The fewest ticks that last so many milliseconds, whatever the oscillator does. To be less than [`LONGEST`].
pub const fn ticks(milliseconds: u16) -> u16 {
    (milliseconds as u32 * FASTEST).div_ceil(DIVIDER) as u16
}

/// The milliseconds that so many ticks last, whatever the oscillator does.
pub const fn milliseconds(ticks: u16) -> u16 {
    (ticks as u32 * DIVIDER / FASTEST) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stm32f405::flash::{SECTORS, longest_erase};

    #[test]
    fn ticks_last_as_long_as_they_are_asked_to() {
        for asked in 1..=milliseconds(LONGEST) {
            let ticks = ticks(asked);
            assert!(milliseconds(ticks) >= asked && milliseconds(ticks - 1) < asked, "{asked}");
        }
        assert_eq!([milliseconds(500), milliseconds(LONGEST)], [340, 2788], "docs/BOARDS.md says so");
    }

    #[test]
    fn the_watchdog_can_wait_for_every_erase() {
        assert!((0..SECTORS).all(|number| ticks(longest_erase(number)) < LONGEST));
    }
}
