//! Regions of the scratch memory.

use core::ops::Range;

use crate::image::Region;

/// Three regions as slices; empty where they overlap or lie outside, which the image's check has excluded.
#[inline(never)]
pub(super) fn regions<'r>(arena: &'r mut [u32], regions: &[Region; 3]) -> [&'r mut [u32]; 3] {
    match arena.get_disjoint_mut(regions.map(Region::range)) {
        Ok([a, b, c]) => [a, b, c],
        Err(_) => [&mut [], &mut [], &mut []],
    }
}

/// Some of a region's words; none where they are not all there.
#[inline(never)]
pub(super) fn part<'r>(region: &'r mut [u32], range: &Range<usize>) -> &'r mut [u32] {
    region.get_mut(range.clone()).unwrap_or_default()
}
