//! Where the slots are.

use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

/// Bytes of a slot before the image: record and marks.
pub const HEADER: u32 = 256;

/// The largest unit in which flash may be written.
pub(crate) const MOST_WRITE: usize = 32;

/// One of two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Slot {
    /// The first.
    A = 0,
    /// The second.
    B = 1,
}

impl Slot {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// The other one.
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// The addresses of two slots in a flash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    a: Range<u32>,
    b: Range<u32>,
}

/// Why slots cannot be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutError {
    /// The flash is not read in units of 1, 2 or 4 bytes or not written in units of 1, 2, 4, 8, 16 or 32.
    Granularity,
    /// A slot does not begin and end between two sectors.
    Sector,
    /// A slot has no room for an image, or is not within the flash.
    Size,
    /// The slots overlap.
    Overlap,
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Granularity => "flash must be read in at most 4 and written in at most 32 bytes, by powers of two",
            Self::Sector => "a slot must begin and end between two sectors",
            Self::Size => "a slot has no room for an image, or is not within the flash",
            Self::Overlap => "the slots overlap",
        })
    }
}

impl core::error::Error for LayoutError {}

impl Layout {
    /// Slots at these addresses of `flash`.
    ///
    /// # Errors
    ///
    /// Where they cannot be there; see [`LayoutError`].
    pub fn new<F: NorFlash>(flash: &F, a: Range<u32>, b: Range<u32>) -> Result<Self, LayoutError> {
        let unit = |size: usize, most: usize| size.is_power_of_two() && size <= most;
        if !unit(F::READ_SIZE, 4) || !unit(F::WRITE_SIZE, MOST_WRITE) {
            return Err(LayoutError::Granularity);
        }
        let sector = u32::try_from(F::ERASE_SIZE).map_err(|_| LayoutError::Granularity)?;
        for slot in [&a, &b] {
            let on_boundary = |at: u32| at.checked_rem(sector) == Some(0);
            if !on_boundary(slot.start) || !on_boundary(slot.end) {
                return Err(LayoutError::Sector);
            }
            let end = usize::try_from(slot.end).map_err(|_| LayoutError::Size)?;
            if slot.end.saturating_sub(slot.start) <= HEADER || end > flash.capacity() {
                return Err(LayoutError::Size);
            }
        }
        if a.start < b.end && b.start < a.end {
            return Err(LayoutError::Overlap);
        }
        Ok(Self { a, b })
    }

    /// A slot's addresses.
    pub const fn range(&self, slot: Slot) -> &Range<u32> {
        match slot {
            Slot::A => &self.a,
            Slot::B => &self.b,
        }
    }

    /// Where a slot's image begins.
    pub const fn image(&self, slot: Slot) -> u32 {
        self.range(slot).start + HEADER
    }

    /// Bytes that the image in a slot may have.
    pub const fn room(&self, slot: Slot) -> u32 {
        self.range(slot).end - self.image(slot)
    }
}
