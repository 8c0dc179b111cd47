//! The registered layouts: by type for generic code, and as a table of constants for other code.

use super::format::{Cell, Format, PAD_COLS, QUAD, STRIP, XLayout};
use super::lanes::Lanes;
use super::width::Width;

/// Constants of a layout, for code that is not generic over it.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Rows, columns and words of a cell.
    pub cell: Cell,
    /// Words of a unit for [`QUAD`] rows.
    pub quad_words: usize,
    /// Rows of a strip.
    pub strip: usize,
    /// Columns to whose multiple rows are padded.
    pub step: usize,
    /// Form of the prepared activations.
    pub x: XLayout,
    /// Columns to whose multiple activations are padded, unless their group is longer.
    pub pad: usize,
    /// Binary logarithm of a column chunk's columns: a call of a GEMV has no division.
    pub chunk_log: u8,
    /// Binary logarithm of a unit's columns.
    pub unit_log: u8,
    /// Binary logarithm of a strip's rows.
    pub strip_log: StripLog,
    /// Binary logarithm of the step.
    pub step_log: u8,
}

/// Binary logarithm of a strip's rows: [`QUAD`] or [`STRIP`]. With an enum, the compiler knows that the shift is in
/// range.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub enum StripLog {
    /// Four rows.
    Quad = QUAD.trailing_zeros() as u8,
    /// Eight.
    Strip = STRIP.trailing_zeros() as u8,
}

// A power of two makes the table quick to index.
const _: () = assert!(size_of::<usize>() != 4 || size_of::<Layout>() == 64);

impl Layout {
    const fn of<F: Format>() -> Self {
        Self {
            cell: F::CELL,
            quad_words: F::CELL.words * QUAD / F::CELL.rows,
            strip: F::STRIP,
            step: F::STEP,
            x: F::X,
            pad: if F::X.chunk == XLayout::ALL && !F::X.has_bytes() { PAD_COLS } else { F::STEP },
            chunk_log: F::X.chunk.trailing_zeros() as u8,
            unit_log: F::CELL.cols.trailing_zeros() as u8,
            strip_log: if F::STRIP == QUAD { StripLog::Quad } else { StripLog::Strip },
            step_log: F::STEP.trailing_zeros() as u8,
        }
    }
}

macro_rules! table {
    (() $($(#[$doc:meta])* $width:ident = $bits:literal if $feature:literal, $grid:ident: $single:path, $paired:path, $scalar:path, $helium:path;)*) => {
        /// Returns the layout of a width and lanes.
        pub(crate) const fn layout(width: Width, lanes: Lanes) -> Layout {
            match (width, lanes) {
                $((Width::$width, Lanes::Single) => Layout::of::<$single>(),
                (Width::$width, Lanes::Paired) => Layout::of::<$paired>(),
                #[cfg(feature = "scalar")]
                (Width::$width, Lanes::Scalar) => Layout::of::<$scalar>(),
                #[cfg(feature = "helium")]
                (Width::$width, Lanes::Helium) => Layout::of::<$helium>(),)*
            }
        }

        /// Calls a function that is generic over the layout of `$shape`, with code for this build's layouts alone: it
        /// refuses blocks that have another one.
        macro_rules! with_format {
            ($shape:expr, $call:ident::<_>$arguments:tt) => {{
                use $crate::layout::lanes::Lanes;
                use $crate::layout::width::Width;
                use $crate::layout::table::has;
                match ($shape.width, $shape.lanes) {
                    $((Width::$width, Lanes::Single) if has(Width::$width, Lanes::Single) => $call::<$single>$arguments,
                    (Width::$width, Lanes::Paired) if has(Width::$width, Lanes::Paired) => $call::<$paired>$arguments,
                    #[cfg(feature = "scalar")]
                    (Width::$width, Lanes::Scalar) if has(Width::$width, Lanes::Scalar) => $call::<$scalar>$arguments,
                    #[cfg(feature = "helium")]
                    (Width::$width, Lanes::Helium) if has(Width::$width, Lanes::Helium) => $call::<$helium>$arguments,)*
                    _ => Default::default(),
                }
            }};
        }
        pub(crate) use with_format;
    };
}
registry!(table());

/// Returns `true` if this build has blocks of a width and lanes. (A writer packs all.)
pub(crate) const fn has(width: Width, lanes: Lanes) -> bool {
    cfg!(feature = "writer") || width.is_built() && lanes.is_built()
}

/// Layouts by width and lanes. A table in memory takes fewer instructions than a branch for every constant.
pub(super) static LAYOUTS: [[Layout; Lanes::IN_TABLES.len()]; Width::IN_TABLES.len()] = {
    let mut layouts =
        [[layout(Width::IN_TABLES[0], Lanes::IN_TABLES[0]); Lanes::IN_TABLES.len()]; Width::IN_TABLES.len()];
    let mut i = 0;
    while i < layouts.as_flattened().len() {
        let (width, lanes) = (i / Lanes::IN_TABLES.len(), i % Lanes::IN_TABLES.len());
        layouts[width][lanes] = layout(Width::IN_TABLES[width], Lanes::IN_TABLES[lanes]);
        i += 1;
    }
    layouts
};
