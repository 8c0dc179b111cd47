//! The marks behind a record: what became of the image.
//!
//! A mark is one unit of writing (4 bytes at least), programmed once, in the first one that is erased. One that was cut
//! short is none of the codes: they have as many ones as each other, and programming only takes ones away.

use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};

use super::layout::MOST_WRITE;

/// Bytes of all marks.
const AREA: u32 = 128;

/// What a mark says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Mark {
    /// A trial of the image begins.
    Trial = 0x6996_5aa5,
    /// Its self-test has passed.
    Confirmed = 0x9669_a55a,
    /// Its self-test has failed.
    Rejected = 0x3cc3_c33c,
}

/// All marks of a slot together.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marks {
    pub(super) trials: u32,
    pub(super) confirmed: bool,
    pub(super) rejected: bool,
    /// Address of the first one that is erased.
    free: Option<u32>,
}

/// Bytes of a mark.
const fn unit<F: NorFlash>() -> usize {
    if F::WRITE_SIZE > 4 { F::WRITE_SIZE } else { 4 }
}

impl Marks {
    /// The marks at an address; `None` where they cannot be read.
    pub(super) fn read<F: NorFlash>(flash: &mut F, start: u32) -> Option<Self> {
        let mut marks = Self::default();
        for at in (start..start + AREA).step_by(unit::<F>()) {
            let mut buffer = [0; MOST_WRITE];
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

    /// Programs a mark; false where there is no room for it or it cannot be written.
    pub(super) fn write<F: NorFlash>(&self, flash: &mut F, mark: Mark) -> bool {
        let mut buffer = [0xff; MOST_WRITE];
        buffer.iter_mut().zip((mark as u32).to_le_bytes()).for_each(|(place, byte)| *place = byte);
        let bytes = buffer.get(..unit::<F>());
        self.free.zip(bytes).is_some_and(|(at, bytes)| flash.write(at, bytes).is_ok())
    }
}

#[cfg(test)]
mod tests {
    use super::Mark;

    #[test]
    fn no_code_becomes_another_by_taking_ones_away() {
        let codes = [Mark::Trial, Mark::Confirmed, Mark::Rejected].map(|mark| mark as u32);
        for a in codes {
            assert_eq!(a.count_ones(), 16);
            for b in codes.into_iter().filter(|b| *b != a) {
                assert_ne!(a & b, b);
            }
        }
    }
}
