//! Operations around a network: they make its input of raw values, and targets of its output. What one keeps for the
//! next step is in its third region, whose last word counts; a reset zeroes all of it.

use core::ops::Range;

use crate::arena::{part, regions};
use crate::error::Fault;
use crate::image::{Around, Op, Region};
use crate::math::ORIENTATION;
use crate::ops::elementwise::{copy, copy_le};

/// Raises a value to `low`, then lowers it to `high`, all as bits. A value or a limit that is not finite gives NaN, so
/// that an overflow stays visible.
#[inline(always)]
fn clip(x: u32, low: u32, high: u32) -> u32 {
    const EXPONENT: u32 = 0x7f80_0000;
    let is_overflow = |bits: u32| bits & EXPONENT == EXPONENT;
    if is_overflow(x) || is_overflow(low) || is_overflow(high) {
        return f32::NAN.to_bits();
    }
    let raised = if f32::from_bits(x) < f32::from_bits(low) { low } else { x };
    if f32::from_bits(raised) > f32::from_bits(high) { high } else { raised }
}

/// Returns `true` if a quaternion's length is near 1. Its squares are added from left to right. NaN is not near.
fn is_orientation(quaternion: &[u32]) -> bool {
    let squares = quaternion.iter().map(|x| f32::from_bits(*x) * f32::from_bits(*x));
    ORIENTATION.contains(&squares.fold(0.0, |sum, square| sum + square))
}

/// Runs a range of an operation's units. Its state advances with the last of them.
///
/// # Errors
///
/// [`Fault::Damaged`] if the image does not have the operation's regions or data, [`Fault::Orientation`] for a
/// quaternion whose length is not near 1.
#[inline(never)]
pub(super) fn run(kind: Around, op: &Op<'_>, arena: &mut [u32], units: &Range<usize>) -> Result<(), Fault> {
    let [dst, src, third, _] = regions(arena, &op.regions, Region::default());
    let is_last = units.end == op.units();
    if dst.is_empty() {
        return Err(Fault::Damaged);
    }
    // Operations that keep something for the next step have a count as their last word.
    let count = third.last().copied().unwrap_or(0);
    let next = match kind {
        Around::Select => {
            if op.half(1) == 1 && !is_orientation(src) {
                return Err(Fault::Orientation);
            }
            for (to, i) in part(dst, units).iter_mut().zip(units.clone()) {
                *to = *src.get(op.half(2 + i)).ok_or(Fault::Damaged)?;
            }
            return Ok(());
        }
        Around::Clip => {
            for (x, (low, high)) in part(dst, units).iter_mut().zip(part(src, units).iter().zip(part(third, units))) {
                *x = clip(*x, *low, *high);
            }
            return Ok(());
        }
        Around::Constant => {
            copy_le(op.part(0, units), part(dst, units));
            return Ok(());
        }
        Around::Initial => {
            if count == 0 {
                copy_le(op.part(0, units), part(dst, units));
            }
            1
        }
        Around::TableRow => {
            let (rows, first) = (op.half(0), op.half(1));
            let row = (count as usize).checked_sub(1).unwrap_or(first).min(rows.saturating_sub(1));
            copy_le(op.part(row, units), part(dst, units));
            // 0 is for a step after a reset.
            1 + if row + 1 < rows { row + 1 } else { op.half(2) } as u32
        }
        Around::Standstill => {
            if !stands(op, src) {
                return Ok(());
            }
            copy_le(op.part(0, units), part(dst, units));
            1
        }
        Around::History => {
            let Some((_, ring)) = third.split_last_mut() else { return Err(Fault::Damaged) };
            let history = History::of(op, count as usize);
            history.run(units, src, ring, dst);
            history.next()
        }
    };
    if is_last {
        *third.last_mut().ok_or(Fault::Damaged)? = next;
    }
    Ok(())
}

/// Returns `true` if the squared norm of each group of `src` is below the limit.
fn stands(op: &Op<'_>, src: &[u32]) -> bool {
    let (limit, lens) = (op.constant(1), 2 * (2 + op.dst().len));
    let mut rest = src;
    (0..op.half(1)).all(|group| {
        let (values, after) = rest.split_at_checked(op.half(lens + group)).unwrap_or_default();
        rest = after;
        let squares = values.iter().map(|x| f32::from_bits(*x) * f32::from_bits(*x));
        squares.fold(0.0, |sum, square| sum + square) < limit
    })
}

/// A history in a step. Frame t since the reset is in slot `t % slots` of the ring.
struct History {
    /// Values of a frame.
    frame: usize,
    /// Frames that are kept: as many steps as the oldest one of the result is back.
    slots: usize,
    /// Frames of the result.
    length: usize,
    /// Steps from a frame of the result to the next.
    stride: usize,
    /// Steps that the newest frame of the result is back.
    newest: usize,
    /// The newest frame comes first.
    newest_first: bool,
    /// Before the first step there is its frame, not zeros.
    first_fills: bool,
    /// Steps since the reset, below twice the slots: from there on slots are subtracted.
    step: usize,
}

impl History {
    fn of(op: &Op<'_>, step: usize) -> Self {
        let [frame, slots, length, stride, newest, flags] = [0, 1, 2, 3, 4, 5].map(|i| op.half(i));
        // No divisor is 0, whatever has become of the image.
        let (frame, slots) = (frame.max(1), slots.max(1));
        let (newest_first, first_fills) = (flags & 1 != 0, flags & 2 != 0);
        Self { frame, slots, length, stride, newest, newest_first, first_fills, step }
    }

    fn run(&self, units: &Range<usize>, src: &[u32], ring: &mut [u32], dst: &mut [u32]) {
        let mut at = units.start;
        while at < units.end.min(dst.len()) {
            let (k, from) = (at / self.frame, at % self.frame);
            let end = (at - from + self.frame).min(units.end);
            let to = part(dst, &(at..end));
            let back = if self.newest_first { k } else { self.length.saturating_sub(k + 1) };
            let age = back.wrapping_mul(self.stride).wrapping_add(self.newest);
            let slot = match self.step.checked_sub(age) {
                Some(step) => Some(step % self.slots),
                None if self.first_fills => Some(0),
                None => None,
            };
            let is_new = age == 0 || self.step == 0 && self.first_fills;
            match slot {
                _ if is_new => copy(src.get(from..).unwrap_or_default(), to),
                Some(slot) => copy(ring.get(slot * self.frame + from..).unwrap_or_default(), to),
                None => to.fill(0),
            }
            at = end;
        }
        // The oldest frame was read; the new one takes its slot.
        let new = at.max(dst.len()) - dst.len()..units.end.max(dst.len()) - dst.len();
        let slot = self.step % self.slots * self.frame;
        copy(part_of(src, &new), part(ring, &(slot + new.start..slot + new.end)));
    }

    fn next(&self) -> u32 {
        // A caller may have written any state.
        let next = self.step.wrapping_add(1);
        (if next >= 2 * self.slots { self.slots } else { next }) as u32
    }
}

fn part_of<'r>(region: &'r [u32], range: &Range<usize>) -> &'r [u32] {
    region.get(range.clone()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::{History, clip};

    /// Frame `t` since a reset.
    fn frame<const N: usize>(t: usize) -> [u32; N] {
        core::array::from_fn(|i| (100 * t + i + 1) as u32)
    }

    /// Compares a history, in two runs of its units, with its definition, until its ring has wrapped three times.
    fn is_kept<const N: usize>(history: History, cut: usize) {
        let len = N * history.length;
        let (mut ring, mut dst) = ([0; 3 * 16], [0; 3 * 4]);
        let mut step = 0;
        for t in 0..3 * history.slots + 2 {
            let now = History { step, ..history };
            // The last units keep the new frame.
            for part in [0..cut, cut..len + N] {
                now.run(&part, &frame::<N>(t), &mut ring[..N * history.slots], &mut dst[..len]);
            }
            step = now.next() as usize;
            for (k, found) in dst[..len].chunks(N).enumerate() {
                let back = if history.newest_first { k } else { history.length - 1 - k };
                let at = t.checked_sub(back * history.stride + history.newest);
                let missing = if history.first_fills { frame(0) } else { [0; N] };
                assert_eq!(found, at.map_or(missing, frame::<N>), "frame {k} in step {t}");
            }
        }
    }

    /// All that the check of images accepts, up to these sizes.
    #[test]
    fn histories_of_every_small_size_keep_their_frames() {
        for (length, stride, newest) in (0..4 * 4 * 2).map(|i| (1 + i % 4, 1 + i / 4 % 4, i / 16)) {
            let slots = ((length - 1) * stride + newest).max(1);
            for flags in 0..4 {
                let (newest_first, first_fills) = (flags & 1 != 0, flags & 2 != 0);
                let of = |frame| History { frame, slots, length, stride, newest, newest_first, first_fills, step: 0 };
                (0..=length + 1).for_each(|cut| is_kept::<1>(of(1), cut));
                (0..=3 * length + 3).for_each(|cut| is_kept::<3>(of(3), cut));
            }
        }
    }

    #[test]
    fn what_is_not_finite_stays_visible() {
        let clipped = |x: f32, low: f32, high: f32| f32::from_bits(clip(x.to_bits(), low.to_bits(), high.to_bits()));
        for (x, expected) in [(-2.0, -1.0), (-0.0, -0.0), (0.5, 0.5), (7.0, 1.0), (f32::MAX, 1.0)] {
            assert_eq!(clipped(x, -1.0, 1.0).to_bits(), f32::to_bits(expected), "{x}");
        }
        for wrong in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for [x, low, high] in [[wrong, -1.0, 1.0], [0.0, wrong, 1.0], [0.0, -1.0, wrong]] {
                assert!(clipped(x, low, high).is_nan(), "{x} within {low} and {high}");
            }
        }
    }
}
