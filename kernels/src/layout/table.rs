//! The registered layouts: by type for code that is generic over them, as a table of constants for code that is not.

use super::format::{Cell, Format, PAD_COLS, QUAD, XLayout};
use super::lanes::Lanes;
use super::width::Width;

/// The constants of a layout, for code that is not generic over it.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Rows, columns and words of a cell.
    pub cell: Cell,
    /// Words of a unit for [`QUAD`] rows.
    pub quad_words: usize,
    /// Rows of a strip.
    pub strip: usize,
    /// Columns that rows are padded to a multiple of.
    pub step: usize,
    /// What the prepared activations look like.
    pub x: XLayout,
    /// Columns that activations are padded to a multiple of, where their group is not longer.
    pub pad: usize,
    /// Binary logarithm of a chunk's columns, because nothing is divided when a GEMV is called.
    pub chunk_log: u32,
    /// The same of a strip's rows.
    pub strip_log: u32,
    /// The same of the step.
    pub step_log: u32,
}

impl Layout {
    const fn of<F: Format>() -> Self {
        Self {
            cell: F::CELL,
            quad_words: F::CELL.words * QUAD / F::CELL.rows,
            strip: F::STRIP,
            step: F::STEP,
            x: F::X,
            pad: if F::X.chunk == XLayout::ALL { PAD_COLS } else { F::STEP },
            chunk_log: F::X.chunk.trailing_zeros(),
            strip_log: F::STRIP.trailing_zeros(),
            step_log: F::STEP.trailing_zeros(),
        }
    }
}

macro_rules! table {
    (() $($(#[$doc:meta])* $width:ident = $bits:literal, $grid:ident:
        $single:ident::$Single:ident, $paired:ident::$Paired:ident;)*) => {
        /// By width and lanes. A table in memory takes fewer instructions than a choice for every constant.
        pub static LAYOUTS: [[Layout; Lanes::ALL.len()]; Width::ALL.len()] =
            [$([Layout::of::<super::$single::$Single>(), Layout::of::<super::$paired::$Paired>()]),*];

        /// Calls a function that is generic over the layout of `$shape`.
        macro_rules! with_format {
            ($shape:expr, $call:ident::<_>$arguments:tt) => {{
                use $crate::layout::{Lanes, Width};
                match ($shape.width, $shape.lanes) {
                    $((Width::$width, Lanes::Single) => $call::<$crate::layout::$single::$Single>$arguments,
                    (Width::$width, Lanes::Paired) => $call::<$crate::layout::$paired::$Paired>$arguments,)*
                }
            }};
        }
    };
}
registry!(table());
pub(crate) use with_format;
