//! Regions of the scratch memory.

use core::ops::Range;

use crate::image::Region;

/// Regions as slices; empty where they overlap or lie outside, which the image's check has excluded.
#[inline(never)]
pub(super) fn regions<'r>(arena: &'r mut [u32], [a, b, c]: &[Region; 3], more: Region) -> [&'r mut [u32]; 4] {
    match arena.get_disjoint_mut([a.range(), b.range(), c.range(), more.range()]) {
        Ok([a, b, c, more]) => [a, b, c, more],
        Err(_) => [&mut [], &mut [], &mut [], &mut []],
    }
}

/// Some of a region's words; none where they are not all there.
#[inline(never)]
pub(super) fn part<'r>(region: &'r mut [u32], range: &Range<usize>) -> &'r mut [u32] {
    region.get_mut(range.clone()).unwrap_or_default()
}
