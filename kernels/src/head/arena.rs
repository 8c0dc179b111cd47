//! Regions of the scratch memory.

use core::ops::Range;

use crate::image::Region;

/// Regions as slices; empty where they overlap or lie outside, which the image's check has excluded.
#[inline(never)]
pub(super) fn regions<'r, const N: usize>(arena: &'r mut [u32], regions: &[Region; N]) -> [&'r mut [u32]; N] {
    arena.get_disjoint_mut(regions.map(Region::range)).unwrap_or_else(|_| core::array::from_fn(|_| Default::default()))
}

/// Some of a region's words; none where they are not all there.
#[inline(never)]
pub(super) fn part<'r>(region: &'r mut [u32], range: &Range<usize>) -> &'r mut [u32] {
    region.get_mut(range.clone()).unwrap_or_default()
}
