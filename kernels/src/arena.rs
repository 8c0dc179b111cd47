//! Regions of the scratch memory.

use core::ops::Range;

use crate::image::Region;

/// Borrows regions as slices. All are empty if two overlap or one lies outside, which a checked image excludes.
#[inline(never)]
pub(crate) fn regions<'r>(arena: &'r mut [u32], [a, b, c]: &[Region; 3], more: Region) -> [&'r mut [u32]; 4] {
    match arena.get_disjoint_mut([a.range(), b.range(), c.range(), more.range()]) {
        Ok([a, b, c, more]) => [a, b, c, more],
        Err(_) => [&mut [], &mut [], &mut [], &mut []],
    }
}

/// Borrows a range of a region's words; empty unless the region has all of them.
#[inline(never)]
pub(crate) fn part<'r>(region: &'r mut [u32], range: &Range<usize>) -> &'r mut [u32] {
    region.get_mut(range.clone()).unwrap_or_default()
}
