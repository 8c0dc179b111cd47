//! The marks after a record: the history of the image.
//!
//! A mark is one unit of writing (at least 4 bytes), programmed once, in the first erased unit. An interrupted one
//! is never a valid code: all codes have the same number of ones, and programming only clears ones.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::layout::MAX_WRITE;

/// Bytes of all marks.
const AREA: u32 = 128;

/// Meaning of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Mark {
    /// A trial of the image begins.
    Trial = 0x6996_5aa5,
    /// The image passed its self-test.
    Confirmed = 0x9669_a55a,
    /// The image failed its self-test.
    Rejected = 0x3cc3_c33c,
}

/// Summary of a slot's marks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marks {
    pub(super) trials: u32,
    pub(super) confirmed: bool,
    pub(super) rejected: bool,
    /// Address of the first erased mark.
    free: Option<u32>,
}

/// Returns the bytes of a mark.
const fn unit<F: NorFlash>() -> usize {
    if F::WRITE_SIZE > 4 { F::WRITE_SIZE } else { 4 }
}

impl Marks {
    /// Reads the marks at an address; `None` if reading fails.
    pub(super) fn read<F: NorFlash>(flash: &mut F, start: u32) -> Option<Self> {
        let mut marks = Self::default();
        for at in (start..start + AREA).step_by(unit::<F>()) {
            let mut buffer = [0; MAX_WRITE];
            let mark = buffer.get_mut(..unit::<F>())?;
            ReadNorFlash::read(flash, at, mark).ok()?;
            if mark.iter().all(|byte| *byte == 0xff) {
                marks.free = marks.free.or(Some(at));
                continue;
            }
            let code = u32::from_le_bytes(*mark.first_chunk()?);
            marks.trials += u32::from(code == Mark::Trial as u32);
            marks.confirmed |= code == Mark::Confirmed as u32;
            marks.rejected |= code == Mark::Rejected as u32;
        }
        Some(marks)
    }

    /// Programs a mark; returns `false` if no mark is free or writing fails.
    pub(super) fn write<F: NorFlash>(&self, flash: &mut F, mark: Mark) -> bool {
        let mut buffer = [0xff; MAX_WRITE];
        buffer.iter_mut().zip((mark as u32).to_le_bytes()).for_each(|(place, byte)| *place = byte);
        let bytes = buffer.get(..unit::<F>());
        self.free.zip(bytes).is_some_and(|(at, bytes)| flash.write(at, bytes).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::Mark;

    #[test]
    fn no_code_becomes_another_by_clearing_ones() {
        let codes = [Mark::Trial, Mark::Confirmed, Mark::Rejected].map(|mark| mark as u32);
        for a in codes {
            assert_eq!(a.count_ones(), 16);
            for b in codes.into_iter().filter(|b| *b != a) {
                assert_ne!(a & b, b);
            }
        }
    }
}
