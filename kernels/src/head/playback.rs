//! Choice of the next action among the network's outputs: an action of a chunk, a blend with the previous chunk, or the
//! average of all chunks that predict it.
//!
//! Time counts in control periods: the position of an action in its chunk is its age when it plays. A later chunk never
//! changes an action that has played or whose period has passed.

use crate::arena::{part, regions};
use crate::error::Fault;
use crate::image::{Image, Region};
use crate::ops::elementwise::copy;

/// Position of playback.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Playback {
    /// `true` if the output holds a chunk; otherwise the network must run.
    pub(super) ready: bool,
    /// Position of the next action in the current chunk, or in the chunk that the network computes next.
    pub(super) next: usize,
    /// The same in the previous chunk, if that is kept; its length if none of it remains.
    pub(super) old: usize,
    /// Index of the next action's sum among the sums that are kept.
    pub(super) slot: usize,
}

impl Playback {
    /// Drops all chunks.
    #[inline(never)]
    pub(super) fn forget(&mut self, image: &Image<'_>, arena: &mut [u32]) {
        *self = Self { old: image.chunk(), ..Self::default() };
        counts(image, arena).fill(0);
    }

    /// Returns `true` if the network must run for the next action. If so, it keeps the rest of the current chunk before
    /// the output is overwritten.
    #[inline(never)]
    pub(super) fn turn(&mut self, image: &Image<'_>, arena: &mut [u32]) -> bool {
        if self.ready && self.next < image.execute() {
            return false;
        }
        if self.ready && image.overlap() > 0 {
            let [output, kept, ..] =
                regions(arena, &[image.output(), image.kept(), Region::default()], Region::default());
            let rest = image.execute() * image.act_len()..output.len();
            copy(part(output, &rest), kept);
            self.old = self.next.min(image.chunk());
        }
        (self.ready, self.next) = (false, 0);
        true
    }

    /// Merges the new chunk in the output with what earlier chunks predict for the same periods.
    #[inline(never)]
    pub(super) fn merge(&mut self, image: &Image<'_>, arena: &mut [u32]) -> Result<(), Fault> {
        let (chunk, len) = (image.chunk(), image.act_len());
        if image.deadline().is_some_and(|age| self.next >= age) {
            return Err(Fault::Stale);
        }
        if chunk == 1 {
            // A single action is for no particular period.
            self.next = 0;
        }
        let [output, kept, ..] = regions(arena, &[image.output(), image.kept(), Region::default()], Region::default());
        if let horizon @ 1.. = image.horizon() {
            let (sums, counts) = kept.split_at_mut_checked(horizon * len).ok_or(Fault::Damaged)?;
            for position in self.next..horizon.min(chunk) {
                let slot = (self.slot + position - self.next) % horizon;
                let new = part(output, &(position * len..position * len + len));
                let sum = part(sums, &(slot * len..slot * len + len));
                let count = counts.get_mut(slot).ok_or(Fault::Damaged)?;
                let [weight, _] = image.ensemble(*count as usize);
                for (sum, new) in sum.iter_mut().zip(new) {
                    let before = if *count == 0 { 0.0 } else { f32::from_bits(*sum) };
                    *sum = (before + weight * f32::from_bits(*new)).to_bits();
                }
                *count += 1;
            }
        }
        let lead = image.overlap().min(chunk - self.old.min(chunk)).min(chunk - self.next.min(chunk));
        if lead > 0 {
            let from = self.next * len;
            let old = self.old.saturating_sub(image.execute()) * len;
            let (new, old) = (part(output, &(from..from + lead * len)), part(kept, &(old..old + lead * len)));
            for (i, (new, old)) in new.iter_mut().zip(old).enumerate() {
                let share = (i / len.max(1) + 1) as f32 / (lead + 1) as f32;
                let (to, old) = (f32::from_bits(*new), f32::from_bits(*old));
                *new = (old * (1.0 - share) + to * share).to_bits();
            }
        }
        (self.ready, self.old) = (true, chunk);
        Ok(())
    }

    /// Returns the arena region of the next action, before the contract.
    ///
    /// # Errors
    ///
    /// [`Fault::Stale`] if no chunk predicts it.
    #[inline(never)]
    pub(super) fn due(&self, image: &Image<'_>, arena: &mut [u32]) -> Result<Region, Fault> {
        let (len, kept) = (image.act_len(), image.kept());
        if let horizon @ 1.. = image.horizon() {
            let count = counts(image, arena).get(self.slot).copied().unwrap_or(0);
            let last = (count as usize).checked_sub(1).ok_or(Fault::Stale)?;
            let [_, by] = image.ensemble(last);
            let sum = Region { offset: kept.offset + self.slot.min(horizon) * len, len };
            part(arena, &sum.range()).iter_mut().for_each(|sum| *sum = (f32::from_bits(*sum) * by).to_bits());
            return Ok(sum);
        }
        let (from, position, at) = match self.ready {
            true => (image.output(), self.next, self.next),
            false => (kept, self.old, self.old.saturating_sub(image.execute())),
        };
        if position >= image.chunk().min(image.deadline().unwrap_or(usize::MAX)) {
            return Err(Fault::Stale);
        }
        Ok(Region { offset: from.offset + at * len, len })
    }

    /// Lets `periods` control periods pass.
    #[inline(never)]
    pub(super) fn pass(&mut self, image: &Image<'_>, arena: &mut [u32], periods: usize) {
        self.next = self.next.saturating_add(periods);
        self.old = self.old.saturating_add(periods).min(image.chunk());
        let horizon = image.horizon();
        for _ in 0..periods.min(horizon) {
            // The sum for this period ends.
            counts(image, arena).iter_mut().skip(self.slot).take(1).for_each(|count| *count = 0);
            self.slot = (self.slot + 1) % horizon;
        }
    }
}

/// For each period that an ensemble keeps, the number of chunks that predict it.
fn counts<'r>(image: &Image<'_>, arena: &'r mut [u32]) -> &'r mut [u32] {
    let (kept, horizon) = (image.kept().range(), image.horizon());
    part(arena, &(kept.end.saturating_sub(horizon)..kept.end))
}
