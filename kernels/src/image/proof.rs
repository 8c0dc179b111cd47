//! Proof that no sum of a row exceeds int32, for any activations.

use crate::activations::{Plan, Scale, max_prepared_words};
use crate::arch::gemv;
use crate::layout::{Block, BlockShape, Lanes, MAX_GROUP, PAD_COLS, STRIP};

/// Words that start values of the scalar layouts take beside those of the others.
const SCALAR_STARTS: usize = if cfg!(feature = "scalar") { 8 } else { 0 };

/// Computes the largest magnitude that an int32 sum of the block's rows can reach for activations up to `x_max`: the
/// largest row sum of `|level| * scale`, times `x_max`. It is exact, in time linear in the number of weights.
pub fn worst_case(block: &Block<'_>, x_max: u16) -> i64 {
    // A block of a valid shape always has a sum.
    largest_sum(block).map_or(i64::MAX, |sum| i64::from(sum) * i64::from(x_max))
}

/// Computes the largest row sum of `|level| * scale`. It has 31 bits: there are at most 65535 columns of 128 * 255.
///
/// The columns of a strip that share a scale (or two, in a layout of paired groups) are a block of their own, and the
/// GEMV of such a block and a unit vector gives one of its columns. So no other code has to know the places of the
/// codes.
#[inline(never)]
fn largest_sum(block: &Block<'_>) -> Option<u32> {
    let mut work = [0; max_prepared_words(MAX_GROUP - 1, MAX_GROUP, Lanes::Single) + SCALAR_STARTS];
    let mut column = [0; STRIP];
    let (shape, mut words) = (block.shape(), block.words());
    let (mut first, mut largest) = (0, 0);
    while first < shape.rows {
        let rows = shape.strip_rows().min(shape.rows - first);
        let (mut sums, mut start) = ([0u32; STRIP], 0);
        while start < shape.cols {
            let groups = 1 + usize::from(shape.layout().x.pairs);
            let cols = (shape.cols - start).min(if shape.group == 0 { PAD_COLS } else { groups * shape.group });
            let Some(piece) = &Block::leading(BlockShape { rows, cols, ..shape }, words) else { return None };
            words = words.get(piece.words().len()..)?;
            let plan = &Plan::of(piece);
            for col in 0..cols {
                let mut unit = [0.0; MAX_GROUP];
                *unit.get_mut(col)? = 1.0;
                let Some(x) = &Scale::ONE.quantize(&mut unit, plan, &mut work) else { return None };
                gemv(piece, x, 0, column.get_mut(..piece.shape().padded_rows())?).ok()?;
                for (sum, value) in sums.iter_mut().zip(&column).take(rows) {
                    *sum += value.unsigned_abs();
                    largest = largest.max(*sum);
                }
            }
            start += cols;
        }
        first += rows;
    }
    Some(largest)
}

/// Returns an upper bound of the rows' sums of `|level| * scale`, from the shape alone. It has 31 bits.
pub fn largest_sum_bound(shape: BlockShape) -> u32 {
    let scale = if shape.group == 0 { 1 } else { 255 };
    shape.cols as u32 * shape.width.max_level() as u32 * scale
}

/// Returns `true` if no sum of the block's rows can exceed int32 for activations up to `x_max`: by the shape alone if
/// that is enough, otherwise by the codes and scales, as [`worst_case`] does.
pub(super) fn fits_i32(block: &Block<'_>, x_max: u16) -> bool {
    let most = (i32::MAX as u32).checked_div(x_max.into()).unwrap_or(0);
    largest_sum_bound(block.shape()) <= most || largest_sum(block).is_some_and(|sum| sum <= most)
}
