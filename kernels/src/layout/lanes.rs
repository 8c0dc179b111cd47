//! How many weights a lane holds, and how many columns may share a scale.

/// Columns that may share a group scale, small to large; powers of two.
pub const GROUPS: [usize; 3] = [32, 64, 128];

/// The most columns that share a group scale.
pub const MAX_GROUP: usize = GROUPS[2];

/// The one group that paired lanes know.
pub(crate) const PAIRED_GROUP: usize = GROUPS[0];

/// Columns that a block of paired lanes may have with group scales. The 2-bit kernel sums twice a row's products
/// (`w2_paired`), `2 * 3 * 127 * 255` a column at most, in an int32.
pub const MAX_PAIRED_GROUPED: usize = 11_051;

/// Whether `group` is one of [`GROUPS`], or 0: no group scales.
pub const fn is_group(group: usize) -> bool {
    const SMALL: usize = GROUPS[0];
    const MIDDLE: usize = GROUPS[1];
    matches!(group, 0 | SMALL | MIDDLE | MAX_GROUP)
}

/// How many weights a 16-bit lane of an SMLAD operand holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Lanes {
    /// One.
    Single,
    /// Two, of different rows; activations are at most 127.
    Paired,
}

impl Lanes {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Single, Self::Paired];

    /// The largest activation that paired lanes hold.
    pub const PAIRED_X_MAX: u16 = 127;

    /// The lanes of a matrix with activations up to `x_max` and scale groups of `group` columns: paired where they can
    /// be, which is for int8 activations and row scales or groups of 32 ([`GROUPS`]).
    pub const fn of(x_max: u16, group: usize) -> Self {
        if x_max <= Self::PAIRED_X_MAX && matches!(group, 0 | PAIRED_GROUP) { Self::Paired } else { Self::Single }
    }

    /// As it stands in a block record: 0 or 1.
    pub const fn code(self) -> u8 {
        match self {
            Self::Single => 0,
            Self::Paired => 1,
        }
    }

    /// The inverse of [`Self::code`].
    #[cfg(feature = "writer")]
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Single),
            1 => Some(Self::Paired),
            _ => None,
        }
    }
}
