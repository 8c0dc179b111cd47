//! Fewer copies: a part of a value is read in its place, a part of a concatenation is computed in its place, and copies
//! of neighbours are one.
//!
//! It works on operations over buffers ([`crate::graph::lowering`]), which the graph's nodes emit one by one.

use actq_kernels::image::OpKind;

use super::lowering::{Buffer, BufferId, Lifetime, Slice, Step};

/// Operations over buffers, in order.
pub(crate) struct Steps<'a> {
    /// The operations.
    pub(crate) steps: Vec<Step<Slice>>,
    /// First operation of the denoising steps, which run several times; 0 if none do.
    pub(crate) first_denoising_op: usize,
    /// The buffers.
    pub(crate) buffers: &'a [Buffer],
}

/// An operation's index, and its operands with other slices.
type Renamed = (usize, [Option<Slice>; 3]);

impl Steps<'_> {
    /// Removes copies. The parts of some buffers stay `apart`: computed elsewhere, and copied.
    pub(crate) fn without_copies(mut self, apart: &dyn Fn(BufferId) -> bool) -> Self {
        let mut at = 0;
        while let Some(step) = self.steps.get(at) {
            let from = step.copied().filter(|_| self.is_of_step(step.dst));
            let renamed = from.and_then(|from| {
                let computed = || if apart(step.dst.buffer) { None } else { self.computed_in_place(at, from) };
                self.read_in_place(at, from).or_else(computed)
            });
            let Some(renamed) = renamed else {
                at += 1;
                continue;
            };
            for (i, operands) in renamed {
                let step = &mut self.steps[i];
                [step.src, step.third] = [operands[1], operands[2]];
                step.dst = operands[0].unwrap_or(step.dst);
            }
            self.remove(at);
        }
        (0..self.steps.len()).for_each(|at| self.hoist(at));
        let mut at = 0;
        while at < self.steps.len() {
            self.merge(at);
            self.repeat(at);
            at += 1;
        }
        self
    }

    fn remove(&mut self, at: usize) {
        self.steps.remove(at);
        self.first_denoising_op -= usize::from(at < self.first_denoising_op);
    }

    /// Moves a copy to where its source is ready, if a later part of its destination is computed in place before it: the
    /// parts are then written in order as often as possible, and leave no gap.
    fn hoist(&mut self, at: usize) {
        let (to, Some(from)) = (self.steps[at].dst, self.steps[at].copied()) else { return };
        let start = if at < self.first_denoising_op { 0 } else { self.first_denoising_op };
        let is_part = |step: &Step<Slice>| step.dst.buffer == to.buffer;
        if self.steps[start..at].iter().any(|step| is_part(step) && step.dst.offset > to.offset) {
            let is_earlier = |step: &Step<Slice>| is_part(step) && step.dst.offset < to.offset;
            let is_before = |step: &Step<Slice>| step.writes(from) || step.touches(to) || is_earlier(step);
            let ready = self.steps[start..at].iter().rposition(is_before).map_or(start, |i| start + i + 1);
            self.steps[ready..=at].rotate_right(1);
        }
    }

    /// Returns the index of a later copy of `from` to `to` that can as well be made at `at`.
    fn movable(&self, at: usize, from: Slice, to: Slice) -> Option<usize> {
        let end = if at < self.first_denoising_op { self.first_denoising_op } else { self.steps.len() };
        let after = self.steps.get(at + 1..end)?;
        let first = after.iter().position(|step| step.touches(to) || step.writes(from))?;
        let is_it = after[first].dst == to && after[first].copied() == Some(from);
        is_it.then_some(at + 1 + first)
    }

    /// Lets the copy at `at` also copy the neighbours of its source to those of its destination, if later copies do.
    fn merge(&mut self, at: usize) {
        while let Some(from) = self.steps[at].copied() {
            let to = self.steps[at].dst;
            let neighbour = self.steps[at + 1..].iter().find_map(|step| {
                let (source, next) = (step.copied()?, step.dst);
                let index = (next.follows(to) && source.follows(from)).then(|| self.movable(at, source, next))??;
                let longer = |slice: Slice| Slice { len: slice.len + next.len, ..slice };
                let both = (longer(from), longer(to));
                (!both.0.overlaps(both.1)).then_some((index, both))
            });
            let Some((index, (from, to))) = neighbour else { break };
            (self.steps[at].src, self.steps[at].dst) = (Some(from), to);
            self.remove(index);
        }
    }

    /// Copies a source several times in a row by fewer copies: of all that is there already.
    fn repeat(&mut self, at: usize) {
        let (first, Some(from)) = (self.steps[at].dst, self.steps[at].copied()) else { return };
        let (mut end, mut others) = (first.offset + first.len, Vec::new());
        while let Some(index) = self.movable(at, from, Slice { offset: end, ..first }) {
            others.push(index);
            end += first.len;
        }
        let is_beside = first.follows(from);
        let mut done = if is_beside { from } else { first };
        let mut copies = if is_beside { Vec::new() } else { vec![(from, first)] };
        while done.offset + done.len < end {
            let to = Slice { offset: done.offset + done.len, len: done.len.min(end - done.offset - done.len), ..done };
            copies.push((Slice { len: to.len, ..done }, to));
            done.len += to.len;
        }
        if copies.len() > others.len() {
            return;
        }
        others.into_iter().rev().for_each(|index| self.remove(index));
        let copy = self.steps[at].clone();
        let more = if at < self.first_denoising_op { copies.len() } else { 0 };
        self.remove(at);
        self.first_denoising_op += more;
        self.steps.splice(at..at, copies.into_iter().map(|(from, dst)| Step { dst, src: Some(from), ..copy.clone() }));
    }

    /// Returns the operands if every reader of the copy reads its source `from` instead.
    fn read_in_place(&self, copy: usize, from: Slice) -> Option<Vec<Renamed>> {
        let to = self.steps[copy].dst;
        if from.buffer == to.buffer || self.steps[..copy].iter().any(|step| step.touches(to)) {
            return None;
        }
        let (mut renamed, mut is_changed) = (Vec::new(), false);
        for (at, step) in self.steps.iter().enumerate().skip(copy + 1) {
            if step.touches(to) {
                if is_changed || step.writes(to) {
                    return None;
                }
                renamed.push((at, step.renamed(to, from)?));
            }
            is_changed |= step.writes(from);
        }
        Some(renamed)
    }

    /// Returns the operands if the copy's source `from` is computed at its destination from the start.
    fn computed_in_place(&self, copy: usize, from: Slice) -> Option<Vec<Renamed>> {
        let to = self.steps[copy].dst;
        if from.buffer == to.buffer || !self.is_of_step(from) {
            return None;
        }
        let first = self.steps.iter().position(|step| step.touches(from))?;
        let is_computed = self.steps[first].writes(from) && !self.steps[first].reads(from);
        let is_once = (first < self.first_denoising_op) == (copy < self.first_denoising_op);
        if !is_computed || !is_once {
            return None;
        }
        let last = self.steps.iter().rposition(|step| step.touches(from))?;
        let mut renamed = Vec::new();
        for (at, step) in self.steps.iter().enumerate().filter(|(at, _)| *at != copy) {
            // From the copy on both have the same content, which must not change as long as both are read.
            let is_changed = (copy..=last).contains(&at) && (step.writes(from) || step.writes(to));
            if is_changed || at < copy && step.touches(to) {
                return None;
            }
            if step.touches(from) {
                renamed.push((at, step.renamed(from, to)?));
            }
        }
        Some(renamed)
    }

    fn is_of_step(&self, slice: Slice) -> bool {
        self.buffers[slice.buffer].lifetime == Lifetime::Step
    }
}

impl Slice {
    /// Returns `true` if it starts where the other ends.
    fn follows(self, other: Self) -> bool {
        self.buffer == other.buffer && self.offset == other.offset + other.len
    }
}

impl Step<Slice> {
    /// Returns the source of a copy.
    fn copied(&self) -> Option<Slice> {
        self.src.filter(|_| self.kind == OpKind::Copy)
    }

    /// Returns destination, source and third operand.
    pub(crate) fn operands(&self) -> [Option<Slice>; 3] {
        [Some(self.dst), self.src, self.third]
    }

    fn touches(&self, slice: Slice) -> bool {
        self.operands().iter().flatten().any(|operand| operand.overlaps(slice))
    }

    /// Returns `true` unless it leaves all values of `slice` as they are.
    fn writes(&self, slice: Slice) -> bool {
        let reads_third = matches!(
            self.kind,
            OpKind::Linear { .. } | OpKind::Keep | OpKind::Attend | OpKind::GruCell | OpKind::Clip | OpKind::Copy
        );
        self.dst.overlaps(slice) || !reads_third && self.third.is_some_and(|third| third.overlaps(slice))
    }

    /// Returns `true` unless its results do not depend on the values of `slice`.
    fn reads(&self, slice: Slice) -> bool {
        let overwrites = matches!(
            self.kind,
            OpKind::Linear { accumulate: false, in_place: false }
                | OpKind::Normalize { .. }
                | OpKind::Copy
                | OpKind::Attend
                | OpKind::Table
                | OpKind::Select
                | OpKind::Constant
        );
        let sources = [self.src, self.third, Some(self.dst).filter(|_| !overwrites)];
        sources.iter().flatten().any(|source| source.overlaps(slice))
    }

    /// Returns the operands with `to` in the place of `from`, of the same length. `None` if one is only partly in `from`,
    /// or two then overlap.
    fn renamed(&self, from: Slice, to: Slice) -> Option<[Option<Slice>; 3]> {
        let mut operands = self.operands();
        for operand in operands.iter_mut().flatten().filter(|operand| operand.overlaps(from)) {
            let offset = operand.offset.checked_sub(from.offset).filter(|o| o + operand.len <= from.len)?;
            *operand = Slice { buffer: to.buffer, offset: to.offset + offset, len: operand.len };
        }
        let [dst, src, third] = operands;
        let overlap = |a: Option<Slice>, b: Option<Slice>| a.zip(b).is_some_and(|(a, b)| a.overlaps(b));
        if overlap(dst, src) || overlap(dst, third) || overlap(src, third) { None } else { Some(operands) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::lowering::StepData;
    use actq_kernels::math::Function;

    /// Buffers of 4 values each: the observation, then values.
    const BUFFERS: [Buffer; 5] = {
        let mut all = [Buffer { len: 4, lifetime: Lifetime::Step }; 5];
        all[0].lifetime = Lifetime::Observation;
        all[4].lifetime = Lifetime::Output;
        all
    };
    const WHOLE: [usize; 2] = [0, 4];
    const LINEAR: OpKind = OpKind::Linear { accumulate: false, in_place: false };
    const RELU: OpKind = OpKind::Function(Function::Relu);

    fn step(kind: OpKind, dst: usize, at: [usize; 2], src: Option<(usize, [usize; 2])>) -> Step<Slice> {
        let slice = |buffer, [offset, len]: [usize; 2]| Slice { buffer, offset, len };
        let src = src.map(|(buffer, at)| slice(buffer, at));
        Step { kind, dst: slice(dst, at), src, third: None, data: StepData::None }
    }

    /// Returns each operation's destination and source, as buffer and offset.
    fn without(steps: Vec<Step<Slice>>, are_apart: bool) -> Vec<[(usize, usize); 2]> {
        let steps = Steps { steps, first_denoising_op: 0, buffers: &BUFFERS }.without_copies(&|_| are_apart);
        let at = |slice: Slice| (slice.buffer, slice.offset);
        steps.steps.iter().map(|step| [at(step.dst), at(step.src.unwrap_or(step.dst))]).collect()
    }

    #[test]
    fn a_part_is_read_in_its_place() {
        let steps = vec![step(OpKind::Copy, 1, [0, 2], Some((0, [2, 2]))), step(LINEAR, 4, WHOLE, Some((1, [0, 2])))];
        assert_eq!(without(steps, true), [[(4, 0), (0, 2)]]);
    }

    #[test]
    fn parts_of_a_concatenation_are_computed_in_their_places() {
        let steps = vec![
            step(LINEAR, 1, [0, 2], Some((0, WHOLE))),
            step(RELU, 1, [0, 2], None),
            step(LINEAR, 2, [0, 2], Some((0, WHOLE))),
            step(OpKind::Copy, 3, [0, 2], Some((1, [0, 2]))),
            step(OpKind::Copy, 3, [2, 2], Some((2, [0, 2]))),
            step(LINEAR, 4, WHOLE, Some((3, WHOLE))),
        ];
        let all = without(steps.clone(), false);
        assert_eq!(all, [[(3, 0), (0, 0)], [(3, 0), (3, 0)], [(3, 2), (0, 0)], [(4, 0), (3, 0)]]);
        assert_eq!(without(steps, true).len(), 6);
    }

    #[test]
    fn a_part_that_is_copied_comes_before_those_computed_after_it() {
        let part = |of: usize, at: usize| step(LINEAR, of, [at, 2], Some((0, WHOLE)));
        let steps = vec![
            part(1, 0),
            part(2, 0),
            step(LINEAR, 4, WHOLE, Some((1, WHOLE))),
            step(OpKind::Copy, 3, [0, 2], Some((1, [0, 2]))),
            step(OpKind::Copy, 3, [2, 2], Some((2, [0, 2]))),
            step(LINEAR, 4, WHOLE, Some((3, WHOLE))),
        ];
        let all = without(steps, false);
        assert_eq!(all[..3], [[(1, 0), (0, 0)], [(3, 0), (1, 0)], [(3, 2), (0, 0)]]);
    }

    #[test]
    fn neighbours_are_copied_together() {
        let part = |at: usize| step(OpKind::Copy, 4, [at, 2], Some((0, [at, 2])));
        let steps = vec![part(0), step(LINEAR, 1, WHOLE, Some((0, WHOLE))), part(2)];
        assert_eq!(without(steps, true), [[(4, 0), (0, 0)], [(1, 0), (0, 0)]]);
        // Not if the destination is read in between.
        let steps = vec![part(0), step(LINEAR, 1, WHOLE, Some((4, WHOLE))), part(2)];
        assert_eq!(without(steps, true).len(), 3);
    }

    #[test]
    fn a_source_that_repeats_is_copied_in_doubles() {
        let value = |at: usize| step(OpKind::Copy, 4, [at, 1], Some((0, [0, 1])));
        let expected = [[(4, 0), (0, 0)], [(4, 1), (4, 0)], [(4, 2), (4, 0)]];
        assert_eq!(without((0..4).map(value).collect(), true), expected);
    }

    #[test]
    fn what_changes_is_copied() {
        // A residual: the function works on a copy, and the value itself is read after it.
        let copy = step(OpKind::Copy, 2, WHOLE, Some((1, WHOLE)));
        let of_value = step(LINEAR, 1, WHOLE, Some((0, WHOLE)));
        let later = step(OpKind::Add, 2, WHOLE, Some((1, WHOLE)));
        let steps = vec![of_value.clone(), copy.clone(), step(RELU, 2, WHOLE, None), later];
        assert_eq!(without(steps, false).len(), 4);
        // The value changes before the copy is read.
        let steps = vec![of_value, copy, step(RELU, 1, WHOLE, None), step(OpKind::Add, 1, WHOLE, Some((2, WHOLE)))];
        assert_eq!(without(steps, false).len(), 4);
    }
}
