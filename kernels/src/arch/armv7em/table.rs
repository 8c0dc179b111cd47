//! The kernels of every layout.

use crate::layout::{BlockShape, Lanes, Width};

/// Reads `strips` strips at `weights` and the prepared vector from `x` up to `x_end`, writes the strips' sums at `acc`.
/// What `extra` is, the kernel's file says; the first pass through the loop of a kernel for row scales leaves `skip` of
/// the layout's steps out.
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

/// The kernel for the layout's strips, and that for a last strip of four rows; where strips have four rows, they are
/// one.
pub(super) type Kernels = [Kernel; 2];

/// A layout's kernels for row scales and for group scales.
type Both = [Kernels; 2];

/// By width and lanes.
static KERNELS: [[Both; Lanes::ALL.len()]; Width::ALL.len()] = [
    [[[actq_w2; 2]; 2], [[actq_w2_paired_row, actq_w2_paired_row4], [actq_w2_paired_group, actq_w2_paired_group4]]],
    [[[actq_w3; 2]; 2], [[actq_w3_paired_row; 2], [actq_w3_paired_group; 2]]],
    [[[actq_w4; 2]; 2], [[actq_w4_paired_row, actq_w4_paired_row4], [actq_w4_paired_group, actq_w4_paired_group4]]],
    [[[actq_w8; 2]; 2], [[actq_w8_paired_row; 2], [actq_w8_paired_group; 2]]],
];

/// The kernels for blocks of this shape.
#[inline(always)]
pub(super) fn kernels(shape: BlockShape) -> Kernels {
    KERNELS[shape.width as usize][shape.lanes as usize][usize::from(shape.group != 0)]
}
