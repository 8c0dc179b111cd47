//! Code widths, and the levels of codes.

macro_rules! widths {
    (() $($(#[$doc:meta])* $width:ident = $bits:literal if $feature:literal, $grid:ident: $($layouts:path),*;)*) => {
        /// Bits of a code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Width {
            $($(#[$doc])* $width,)*
        }

        impl Width {
            /// All widths, narrow to wide.
            pub const ALL: [Self; [$($bits),*].len()] = [$(Self::$width),*];

            /// Returns the width of `bits` bits, if there is one.
            pub const fn from_bits(bits: u32) -> Option<Self> {
                Some(match bits {
                    $($bits => Self::$width,)*
                    _ => return None,
                })
            }

            /// Returns the bits of a code.
            pub const fn bits(self) -> u32 {
                match self {
                    $(Self::$width => $bits,)*
                }
            }

            /// Returns the feature of this crate with the width's kernels.
            pub(crate) const fn feature(self) -> &'static str {
                match self {
                    $(Self::$width => $feature,)*
                }
            }

            /// Returns `true` if this build has the width's kernels.
            pub(crate) const fn is_built(self) -> bool {
                match self {
                    $(Self::$width => cfg!(feature = $feature),)*
                }
            }

            const fn grid(self) -> Grid {
                match self {
                    $(Self::$width => Grid::$grid,)*
                }
            }
        }
    };
}
registry!(widths());

/// Levels of codes.
#[derive(Clone, Copy)]
enum Grid {
    /// Odd levels, symmetric around 0: `2*code - (2^b - 1)`.
    Odd,
    /// The code itself, as two's complement of 8 bits.
    Whole,
}

impl Width {
    /// The widths with entries in tables: the only one of this build, otherwise all. (A writer packs others, too.)
    pub(crate) const IN_TABLES: &'static [Self] = {
        let (mut built, mut only, mut i) = (0, 0, 0);
        while i < Self::ALL.len() {
            if Self::ALL[i].is_built() {
                (built, only) = (built + 1, i);
            }
            i += 1;
        }
        if built == 1 && !cfg!(feature = "writer") { Self::ALL.split_at(only).1.split_at(1).0 } else { &Self::ALL }
    };

    /// Returns the width's index in a table. (No block has a width that the build does not: `image::matrix` refuses
    /// it.)
    #[inline(always)]
    pub(crate) const fn index(self) -> usize {
        if Self::IN_TABLES.len() == 1 { 0 } else { self as usize }
    }

    /// Returns the level (weight divided by its scale) of `code`. Bits of `code` above the width are ignored.
    pub const fn level(self, code: u8) -> i32 {
        match self.grid() {
            Grid::Whole => code as i8 as i32,
            Grid::Odd => {
                let top = (1 << self.bits()) - 1;
                2 * (code as i32 & top) - top
            }
        }
    }

    /// Returns the largest magnitude of a level.
    pub const fn max_level(self) -> i32 {
        match self.grid() {
            Grid::Whole => 128,
            Grid::Odd => (1 << self.bits()) - 1,
        }
    }

    /// Returns the code whose level is nearest to `x` (a weight divided by its scale); ties go to the even code. At 8
    /// bits the result is symmetric: it is never -128. NaN gives the lowest code.
    pub fn nearest_code(self, x: f32) -> u8 {
        match self.grid() {
            Grid::Whole => libm::rintf(x.clamp(-127.0, 127.0)) as i32 as u8,
            Grid::Odd => {
                let top = (1u32 << self.bits()) - 1;
                libm::rintf((x + top as f32) * 0.5).clamp(0.0, top as f32) as u8
            }
        }
    }
}
