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

/// Stands for the kernels of a width that the build leaves out. It does nothing: `image::matrix` refuses such blocks.
unsafe extern "C" fn left_out(_: *const u32, _: *const u32, _: *mut i32, _: usize, _: *const u32, _: usize, _: usize) {}

/// Returns a width's kernels if the build has them.
const fn built(width: Width, kernels: [Both; Lanes::ALL.len()]) -> [Both; Lanes::ALL.len()] {
    if width.is_built() { kernels } else { [[[left_out; 2]; 2]; Lanes::ALL.len()] }
}

/// Kernels by width and lanes.
static KERNELS: [[Both; Lanes::ALL.len()]; Width::ALL.len()] = [
    built(
        Width::W2,
        [[[actq_w2; 2]; 2], [[actq_w2_paired_row, actq_w2_paired_row4], [actq_w2_paired_group, actq_w2_paired_group4]]],
    ),
    built(Width::W3, [[[actq_w3; 2]; 2], [[actq_w3_paired_row; 2], [actq_w3_paired_group; 2]]]),
    built(
        Width::W4,
        [[[actq_w4; 2]; 2], [[actq_w4_paired_row, actq_w4_paired_row4], [actq_w4_paired_group, actq_w4_paired_group4]]],
    ),
    built(Width::W8, [[[actq_w8; 2]; 2], [[actq_w8_paired_row; 2], [actq_w8_paired_group; 2]]]),
];

/// Returns the kernels for blocks of this shape.
#[inline(always)]
pub(super) fn kernels(shape: BlockShape) -> Kernels {
    KERNELS[shape.width as usize][shape.lanes as usize][usize::from(shape.group != 0)]
}
