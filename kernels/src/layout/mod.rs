//! Packed weight layouts: the weights in flash, defined once for the packer, the reference and the kernels.
//!
//! A [`Block`] is successive rows of one [`Width`]. Its rows are interleaved in **strips** of 4 or 8, so that one load
//! of activations serves all of them and the weights are read strictly forward. A layout packs **cells**: a few rows by
//! a few columns in whole words. A strip is a sequence of **units**. A unit has the columns of one cell and as many
//! cells as the strip's rows need; word `k` of all its cells is next to each other:
//!
//! ```text
//! strip:  unit 0: w0(cell 0) w0(cell 1) .. [w1(cell 0) w1(cell 1) ..]   unit 1: ...   [scales of group 0]   ...
//! ```
//!
//! With group scales, a word of four u8 for every four rows (the first in the low byte) follows the units of each
//! group. In strips of eight of [`w2_paired`], the scales of two groups follow the units of both: a word for every two
//! rows, with their scales in the first group and then those in the second. A last group without a partner has its own
//! words. If at most four rows remain for the last strip of eight, it is a strip of four. Rows after the block's last
//! one, up to the strip's end, and columns after the last, up to a multiple of the kernel's step, are padding with code
//! 0.
//!
//! Every width has four layouts. Two are for the DSP extension. In **single** lanes, each signed 16-bit lane of an SMLAD operand holds one weight, and
//! the activations may have 16 bits. In **paired** lanes a lane holds the weights of two rows, one SMLAD computes four
//! MACs, and the sums are separated when they are full; that needs `|x| <= 127`. The **scalar** layouts, of the feature
//! `scalar`, are for cores without that extension: bit planes that index tables of sums at 2 and 3 bits, two rows in one
//! product at 4 and 8. The layouts of the feature `helium` have the bytes of four units of a cell next to each other, which
//! are a vector. Both need `|x| <= 127`, too.
//!
//! | layout | levels (weight / scale) | cell: rows x columns in words | strip | bits per weight before scales |
//! |---|---|---|---|---|
//! | [`w2`] | -3, -1, 1, 3 | 1 x 16 in 1 | 4 | 2 |
//! | [`w3`] | -7, -5 .. 7 | 1 x 32 in 3 | 4 | 3 |
//! | [`w4`] | -15, -13 .. 15 | 1 x 8 in 1 | 4 | 4 |
//! | [`w8`] | -128 .. 127 | 1 x 4 in 1 | 4 | 8 |
//! | [`w2_paired`] | as w2 | 2 x 8 in 1 | 8 | 2 |
//! | [`w3_paired`] | as w3 | 4 x 8 in 3 | 4 | 3 |
//! | [`w4_paired`] | as w4 | 4 x 2 in 1 | 8 | 4 |
//! | [`w8_paired`] | as w8 | 2 x 2 in 1 | 4 | 8 |
//! | `w2_scalar` | as w2 | 4 x 8 in 2 | 8 | 2 |
//! | `w3_scalar` | as w3 | 4 x 8 in 3 | 8 | 3 |
//! | `w4_scalar` | as w4 | 4 x 2 in 1 | 8 | 4 |
//! | `w8_scalar` | as w8 | 4 x 2 in 2 | 4 | 8 |
//! | `w2_helium` | as w2 | 4 x 4 in 1 | 8 | 2 |
//! | `w3_helium` | as w3 | 4 x 8 in 3 | 4 | 3 |
//! | `w4_helium` | as w4 | 2 x 4 in 1 | 8 | 4 |
//! | `w8_helium` | as w8 | 1 x 4 in 1 | 8 | 8 |
//!
//! Narrow widths use the mid-rise grid of odd levels: for bell-shaped weights four levels at ±1, ±3 lose about a third
//! less than -2 .. 1 do. A level is `2*code - (2^b - 1)`. The kernels multiply with the codes, and the start values in
//! the prepared activations ([`XLayout`]) cancel the offset of the codes.
//!
//! To add a width: its layout files here, its line in `registry!` below and in the table above, its kernels' line
//! in `arch/armv7em/table.rs`, and another [`LAYOUT_STAMP`].

/// The registry: a line for every width, with its bits, its feature, the grid of its levels (`Grid`), and its layouts
/// of single lanes, of paired lanes, without lanes and for Helium. It passes all lines to another macro, after a first argument for that.
macro_rules! registry {
    ($for_all:ident $first:tt) => {
        $for_all! {
            $first
            /// 2 bits: levels -3, -1, 1, 3.
            W2 = 2 if "w2", Odd: crate::layout::w2::W2, crate::layout::w2_paired::W2Paired, crate::layout::w2_scalar::W2Scalar, crate::layout::w2_helium::W2Helium;
            /// 3 bits: odd levels -7 to 7.
            W3 = 3 if "w3", Odd: crate::layout::w3::W3, crate::layout::w3_paired::W3Paired, crate::layout::w3_scalar::W3Scalar, crate::layout::w3_helium::W3Helium;
            /// 4 bits: odd levels -15 to 15.
            W4 = 4 if "w4", Odd: crate::layout::w4::W4, crate::layout::w4_paired::W4Paired, crate::layout::w4_scalar::W4Scalar, crate::layout::w4_helium::W4Helium;
            /// 8 bits: levels -128 to 127.
            W8 = 8 if "w8", Whole: crate::layout::w8::W8, crate::layout::w8_paired::W8Paired, crate::layout::w8_scalar::W8Scalar, crate::layout::w8_helium::W8Helium;
        }
    };
}

mod block;
mod format;
pub(crate) mod half;
pub(crate) mod lanes;
mod pack;
mod pow2;
pub(crate) mod table;
pub mod w2;
#[cfg(feature = "helium")]
pub mod w2_helium;
pub mod w2_paired;
#[cfg(feature = "scalar")]
pub mod w2_scalar;
pub mod w3;
#[cfg(feature = "helium")]
pub mod w3_helium;
pub mod w3_paired;
#[cfg(feature = "scalar")]
pub mod w3_scalar;
pub mod w4;
#[cfg(feature = "helium")]
pub mod w4_helium;
pub mod w4_paired;
#[cfg(feature = "scalar")]
pub mod w4_scalar;
pub mod w8;
#[cfg(feature = "helium")]
pub mod w8_helium;
pub mod w8_paired;
#[cfg(feature = "scalar")]
pub mod w8_scalar;
pub(crate) mod width;

pub use block::{Block, BlockShape};
pub use format::{Cell, Start};
pub use format::{Format, Kernel, Sums};
pub use format::{PAD_COLS, QUAD, STRIP, XLayout};
pub use lanes::{GROUPS, MAX_PAIRED_GROUPED};
pub use lanes::{Lanes, MAX_GROUP, is_group};
pub use pack::{PackError, pack};
pub(crate) use pow2::{div_down, div_up, round_up};
pub use table::Layout;
pub use table::StripLog;
#[cfg(actq_fpu)]
pub(crate) use table::layout;
pub(crate) use table::with_format;
pub use width::Width;

/// Version of the packed layouts. It changes when one of them changes; every image holds it.
pub const LAYOUT_STAMP: u32 = 4;
