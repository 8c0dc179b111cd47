//! Addresses of the slots.

use core::fmt;
use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

/// Bytes of a slot before the image: record and marks.
pub const HEADER: u32 = 256;

/// Largest unit of writing, in bytes.
pub(crate) const MAX_WRITE: usize = 32;

/// One of two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Slot {
    /// The first slot.
    A = 0,
    /// The second slot.
    B = 1,
}

impl Slot {
    /// Both slots.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// Returns the other slot.
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

/// Reason why slots cannot be at these addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutError {
    /// The flash's read unit is not 1, 2 or 4 bytes, or its write unit not 1, 2, 4, 8, 16 or 32 bytes.
    Granularity,
    /// A slot does not begin and end at a sector boundary.
    Sector,
    /// A slot has no room for an image, or is not within the flash.
    Size,
    /// The slots overlap.
    Overlap,
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Granularity => {
                "the flash's read unit must be 1, 2 or 4 bytes and its write unit a power of two up to 32 bytes"
            }
            Self::Sector => "a slot must begin and end at a sector boundary",
            Self::Size => "a slot has no room for an image, or is not within the flash",
            Self::Overlap => "the slots overlap",
        })
    }
}

impl core::error::Error for LayoutError {}

impl Layout {
    /// Creates slots at these addresses of `flash`.
    ///
    /// # Errors
    ///
    /// Fails if slots cannot be at these addresses; see [`LayoutError`].
    pub fn new<F: NorFlash>(flash: &F, a: Range<u32>, b: Range<u32>) -> Result<Self, LayoutError> {
        let unit = |size: usize, most: usize| size.is_power_of_two() && size <= most;
        if !unit(F::READ_SIZE, 4) || !unit(F::WRITE_SIZE, MAX_WRITE) {
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

    /// Returns a slot's addresses.
    pub const fn range(&self, slot: Slot) -> &Range<u32> {
        match slot {
            Slot::A => &self.a,
            Slot::B => &self.b,
        }
    }

    /// Returns the address of a slot's image.
    pub const fn image(&self, slot: Slot) -> u32 {
        self.range(slot).start + HEADER
    }

    /// Returns the largest size of an image in a slot, in bytes.
    pub const fn room(&self, slot: Slot) -> u32 {
        self.range(slot).end - self.image(slot)
    }
}
