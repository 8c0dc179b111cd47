//! Weights in a lane, and group sizes.

/// Group sizes in columns, small to large; powers of two.
pub const GROUPS: [usize; 3] = [32, 64, 128];

/// Largest group size.
pub const MAX_GROUP: usize = GROUPS[2];

/// The only group size of paired lanes.
pub(super) const PAIRED_GROUP: usize = GROUPS[0];

/// Most columns of a block of paired lanes with group scales. The 2-bit kernel sums twice a row's products
/// (`w2_paired`), `2 * 3 * 127 * 255` a column at most, in an int32.
pub const MAX_PAIRED_GROUPED: usize = 11_051;

/// Returns `true` if `group` is one of [`GROUPS`], or 0: no group scales.
pub const fn is_group(group: usize) -> bool {
    const SMALL: usize = GROUPS[0];
    const MIDDLE: usize = GROUPS[1];
    matches!(group, 0 | SMALL | MIDDLE | MAX_GROUP)
}

/// Weights in a 16-bit lane of an SMLAD operand, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Lanes {
    /// One.
    Single,
    /// Two, of different rows; activations are at most 127.
    Paired,
    /// No lanes: layouts for cores without the DSP extension; activations are at most 127.
    #[cfg(feature = "scalar")]
    Scalar,
    /// Vectors of bytes: layouts for cores with Helium; activations are at most 127.
    #[cfg(feature = "helium")]
    Helium,
}

impl Lanes {
    /// All of them.
    pub const ALL: [Self; 2 + cfg!(feature = "scalar") as usize + cfg!(feature = "helium") as usize] = [
        Self::Single,
        Self::Paired,
        #[cfg(feature = "scalar")]
        Self::Scalar,
        #[cfg(feature = "helium")]
        Self::Helium,
    ];

    /// Those of the DSP extension.
    pub const DSP: [Self; 2] = [Self::Single, Self::Paired];

    /// Largest activation of all lanes but single ones.
    pub const PAIRED_X_MAX: u16 = 127;

    /// Returns the DSP extension's lanes of a matrix with activations up to `x_max` and group size `group`: paired for int8 activations
    /// with row scales or groups of 32 ([`GROUPS`]), otherwise single.
    pub const fn of(x_max: u16, group: usize) -> Self {
        if x_max <= Self::PAIRED_X_MAX && matches!(group, 0 | PAIRED_GROUP) { Self::Paired } else { Self::Single }
    }

    /// Returns the feature of this crate with the kernels of these lanes.
    pub(crate) const fn feature(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Paired => "paired",
            #[cfg(feature = "scalar")]
            Self::Scalar => "scalar",
            #[cfg(feature = "helium")]
            Self::Helium => "helium",
        }
    }

    /// Returns `true` if this build has the kernels of these lanes.
    pub(crate) const fn is_built(self) -> bool {
        match self {
            Self::Single => cfg!(feature = "single"),
            Self::Paired => cfg!(feature = "paired"),
            #[cfg(feature = "scalar")]
            Self::Scalar => true,
            #[cfg(feature = "helium")]
            Self::Helium => true,
        }
    }

    /// The lanes with entries in tables: the only ones of this build, otherwise all. (A writer packs others, too.)
    pub(crate) const IN_TABLES: &'static [Self] = match (Self::Single.is_built(), Self::Paired.is_built()) {
        _ if cfg!(feature = "writer") => &Self::ALL,
        #[cfg(all(feature = "scalar", not(feature = "helium")))]
        (false, false) => &[Self::Scalar],
        #[cfg(all(feature = "helium", not(feature = "scalar")))]
        (false, false) => &[Self::Helium],
        _ if cfg!(any(feature = "scalar", feature = "helium")) => &Self::ALL,
        (true, false) => &[Self::Single],
        (false, true) => &[Self::Paired],
        _ => &Self::ALL,
    };

    /// Returns the lanes' index in a table. (No block has lanes that the build does not: `image::matrix` refuses it.)
    #[inline(always)]
    pub(crate) const fn index(self) -> usize {
        if Self::IN_TABLES.len() == 1 { 0 } else { self as usize }
    }

    /// Returns the code in a block record.
    pub const fn code(self) -> u8 {
        match self {
            Self::Single => 0,
            Self::Paired => 1,
            #[cfg(feature = "scalar")]
            Self::Scalar => 2,
            #[cfg(feature = "helium")]
            Self::Helium => 3,
        }
    }

    /// Returns the lanes of a [code](Self::code).
    pub const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Single),
            1 => Some(Self::Paired),
            #[cfg(feature = "scalar")]
            2 => Some(Self::Scalar),
            #[cfg(feature = "helium")]
            3 => Some(Self::Helium),
            _ => None,
        }
    }
}
