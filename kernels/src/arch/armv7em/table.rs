//! The kernels of every layout.

use crate::layout::{BlockShape, Lanes, Width};

/// A kernel: it reads `strips` strips at `weights` and the prepared vector from `x` up to `x_end`, and writes the
/// strips' sums at `acc`. The kernel's file documents `extra`. The first pass through the loop of a kernel for row
/// scales skips `skip` of the layout's steps.
pub(super) type Kernel = unsafe extern "C" fn(
    weights: *const u32,
    x: *const u32,
    acc: *mut i32,
    strips: usize,
    x_end: *const u32,
    extra: usize,
    skip: usize,
);

macro_rules! kernels {
    ($($name:ident)*) => {
        unsafe extern "C" {
            $(fn $name(
                weights: *const u32,
                x: *const u32,
                acc: *mut i32,
                strips: usize,
                x_end: *const u32,
                extra: usize,
                skip: usize,
            );)*
        }
    };
}
kernels! {
    actq_w2 actq_w3 actq_w4 actq_w8
    actq_w2_paired_row actq_w2_paired_row4 actq_w2_paired_group actq_w2_paired_group4
    actq_w3_paired_row actq_w3_paired_group
    actq_w4_paired_row actq_w4_paired_row4 actq_w4_paired_group actq_w4_paired_group4
    actq_w8_paired_row actq_w8_paired_group
}

/// The kernel for the layout's strips, and the kernel for a last strip of four rows; the same if strips have four rows.
pub(super) type Kernels = [Kernel; 2];

/// A layout's kernels for row scales and for group scales.
type Both = [Kernels; 2];

/// Stands for the kernels that the build leaves out. It does nothing: `image::matrix` refuses such blocks.
unsafe extern "C" fn left_out(_: *const u32, _: *const u32, _: *mut i32, _: usize, _: *const u32, _: usize, _: usize) {}

/// Returns the kernels of a width and lanes that the build has.
const fn built(width: Width, lanes: Lanes) -> Both {
    let both: Both = match (width, lanes) {
        _ if !width.is_built() || !lanes.is_built() => [[left_out; 2]; 2],
        (Width::W2, Lanes::Single) => [[actq_w2; 2]; 2],
        (Width::W2, Lanes::Paired) => {
            [[actq_w2_paired_row, actq_w2_paired_row4], [actq_w2_paired_group, actq_w2_paired_group4]]
        }
        (Width::W3, Lanes::Single) => [[actq_w3; 2]; 2],
        (Width::W3, Lanes::Paired) => [[actq_w3_paired_row; 2], [actq_w3_paired_group; 2]],
        (Width::W4, Lanes::Single) => [[actq_w4; 2]; 2],
        (Width::W4, Lanes::Paired) => {
            [[actq_w4_paired_row, actq_w4_paired_row4], [actq_w4_paired_group, actq_w4_paired_group4]]
        }
        (Width::W8, Lanes::Single) => [[actq_w8; 2]; 2],
        (Width::W8, Lanes::Paired) => [[actq_w8_paired_row; 2], [actq_w8_paired_group; 2]],
        // In Rust.
        #[cfg(feature = "scalar")]
        (_, Lanes::Scalar) => [[left_out; 2]; 2],
        // In Rust, or for Helium.
        #[cfg(feature = "helium")]
        (_, Lanes::Helium) => [[left_out; 2]; 2],
    };
    if cfg!(feature = "groups") { both } else { [both[0], [left_out; 2]] }
}

/// Kernels by width and lanes.
static KERNELS: [[Both; Lanes::IN_TABLES.len()]; Width::IN_TABLES.len()] = {
    let mut kernels = [[[[left_out as Kernel; 2]; 2]; Lanes::IN_TABLES.len()]; Width::IN_TABLES.len()];
    let mut i = 0;
    while i < Width::IN_TABLES.len() * Lanes::IN_TABLES.len() {
        let (width, lanes) = (i / Lanes::IN_TABLES.len(), i % Lanes::IN_TABLES.len());
        kernels[width][lanes] = built(Width::IN_TABLES[width], Lanes::IN_TABLES[lanes]);
        i += 1;
    }
    kernels
};

/// Returns the kernels for blocks of this shape.
#[inline(always)]
pub(super) fn kernels(shape: BlockShape) -> Kernels {
    KERNELS[shape.width.index()][shape.lanes.index()][usize::from(shape.has_groups())]
}
