//! The time of the independent watchdog (RM0090, section 21). Its ticks come from its own oscillator, divided by 32.
//! The oscillator has nominally 32 kHz, actually 17 to 47 kHz (data sheet DS8626), so a tick is nominally 1 ms,
//! actually 0.68 to 1.9 ms.

/// Highest frequency of the oscillator, in kHz.
const MAX_KHZ: u32 = 47;
/// Divider of the oscillator.
const DIVIDER: u32 = 32;

/// Largest number of ticks.
pub const MAX_TICKS: u16 = 4096;

/// Returns the fewest ticks that last at least `milliseconds` at any frequency of the oscillator. The result must be
/// below [`MAX_TICKS`].
pub const fn ticks(milliseconds: u16) -> u16 {
    (milliseconds as u32 * MAX_KHZ).div_ceil(DIVIDER) as u16
}

/// Returns the milliseconds that `ticks` last at least, at any frequency of the oscillator.
pub const fn milliseconds(ticks: u16) -> u16 {
    (ticks as u32 * DIVIDER / MAX_KHZ) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stm32f405::flash::{SECTORS, longest_erase};

    #[test]
    fn ticks_last_at_least_the_requested_time() {
        for asked in 1..=milliseconds(MAX_TICKS) {
            let ticks = ticks(asked);
            assert!(milliseconds(ticks) >= asked && milliseconds(ticks - 1) < asked, "{asked}");
        }
        assert_eq!([milliseconds(500), milliseconds(MAX_TICKS)], [340, 2788], "docs/BOARDS.md says so");
    }

    #[test]
    fn the_watchdog_covers_every_erase() {
        assert!((0..SECTORS).all(|number| ticks(longest_erase(number)) < MAX_TICKS));
    }
}
