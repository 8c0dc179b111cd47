//! Operations over buffers, one after the other.

use actq::graph::Graph;
use actq::graph::lowering::{Buffer, BufferId, Lifetime, Slice, Step, StepData};
use actq::graph::steps::operations;
use actq_kernels::image::OpKind;

/// Time of operations, relative to the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Phase {
    #[default]
    Before,
    After,
}

impl Phase {
    /// Returns the first phase in which an operation can run.
    pub(super) fn of(depends_on_network: bool) -> Self {
        if depends_on_network { Self::After } else { Self::Before }
    }
}

/// Operations before and after the network, and the buffers of both.
#[derive(Debug, Default)]
pub(super) struct Operations {
    pub(super) buffers: Vec<Buffer>,
    pub(super) before: Vec<Step<Slice>>,
    pub(super) after: Vec<Step<Slice>>,
    /// Phase of the operations that are emitted now.
    pub(super) phase: Phase,
}

impl Operations {
    pub(super) fn buffer(&mut self, len: usize, lifetime: Lifetime) -> BufferId {
        self.buffers.push(Buffer { len, lifetime });
        self.buffers.len() - 1
    }

    /// Returns a new buffer for values of this tick.
    pub(super) fn value(&mut self, len: usize) -> Slice {
        Slice { buffer: self.buffer(len, Lifetime::Step), offset: 0, len }
    }

    /// Returns a new buffer that a reset zeroes.
    pub(super) fn state(&mut self, len: usize) -> Slice {
        Slice { buffer: self.buffer(len, Lifetime::State), offset: 0, len }
    }

    pub(super) fn emit(&mut self, kind: OpKind, dst: Slice, src: Option<Slice>, third: Option<Slice>, data: StepData) {
        let steps = match self.phase {
            Phase::Before => &mut self.before,
            Phase::After => &mut self.after,
        };
        steps.push(Step { kind, dst, src, third, data });
    }

    pub(super) fn copy(&mut self, src: Slice, dst: Slice) {
        self.emit(OpKind::Copy, dst, Some(src), None, StepData::None);
    }

    /// Puts slices one after the other; a single one, or parts of a buffer in order, stay where they are.
    pub(super) fn concatenated(&mut self, parts: &[Slice]) -> Slice {
        let follows =
            |pair: &[Slice]| pair[0].buffer == pair[1].buffer && pair[0].offset + pair[0].len == pair[1].offset;
        let len = parts.iter().map(|part| part.len).sum();
        if parts.windows(2).all(follows) {
            return Slice { len, ..parts[0] };
        }
        let dst = self.value(len);
        let mut offset = 0;
        for part in parts {
            self.copy(*part, Slice { offset, len: part.len, ..dst });
            offset += part.len;
        }
        dst
    }

    /// Selects values by their places; places in order stay where they are.
    pub(super) fn select(&mut self, src: Slice, places: &[usize]) -> Slice {
        if let [first, ..] = *places
            && places.iter().zip(first..).all(|(place, i)| *place == i)
        {
            return Slice { offset: src.offset + first, len: places.len(), ..src };
        }
        self.selected(src, 0, places)
    }

    /// Copies a quaternion; the step fails if it is not an orientation.
    pub(super) fn orientation(&mut self, quaternion: Slice) -> Slice {
        self.selected(quaternion, 1, &[0, 1, 2, 3])
    }

    fn selected(&mut self, src: Slice, is_orientation: usize, places: &[usize]) -> Slice {
        let halves: Vec<usize> = [src.len, is_orientation].into_iter().chain(places.iter().copied()).collect();
        let dst = self.value(places.len());
        self.emit(OpKind::Select, dst, Some(src), None, StepData::Words(words(&halves)));
        dst
    }

    /// Computes `clamp((src - mean) * scale, ±limit)`.
    pub(super) fn normalize(&mut self, src: Slice, mean: &[f32], scale: &[f32], limit: f32) -> Slice {
        let dst = self.value(src.len);
        let constants = [f32::INFINITY, limit].iter().chain(mean).chain(scale).copied().collect();
        self.emit(OpKind::Normalize { added: false }, dst, Some(src), None, StepData::Constants(constants));
        dst
    }

    /// Multiplies every value by a number.
    pub(super) fn times(&mut self, src: Slice, factor: f32) -> Slice {
        self.normalize(src, &vec![0.0; src.len], &vec![factor; src.len], f32::INFINITY)
    }

    pub(super) fn plus(&mut self, src: Slice, numbers: &[f32]) -> Slice {
        let mean: Vec<f32> = numbers.iter().map(|number| -number).collect();
        self.normalize(src, &mean, &vec![1.0; src.len], f32::INFINITY)
    }

    pub(super) fn constant(&mut self, numbers: &[f32]) -> Slice {
        let dst = self.value(numbers.len());
        self.emit(OpKind::Constant, dst, None, None, StepData::Constants(numbers.to_vec()));
        dst
    }

    /// Copies a value that an operation in place will overwrite.
    pub(super) fn writable_copy(&mut self, src: Slice) -> Slice {
        let dst = self.value(src.len);
        self.copy(src, dst);
        dst
    }

    /// Computes an operation in place of `dst`, with a second operand.
    pub(super) fn with(&mut self, kind: OpKind, dst: Slice, src: Slice) {
        self.emit(kind, dst, Some(src), None, StepData::None);
    }

    /// Appends the operations of a network without weights.
    pub(super) fn network(&mut self, graph: &Graph, observation: Slice) -> Slice {
        let (steps, buffers, output) = operations(graph);
        let base = self.buffers.len();
        self.buffers.extend(&buffers[1..]);
        let placed = |s: Slice| match s.buffer {
            0 => Slice { offset: observation.offset + s.offset, buffer: observation.buffer, ..s },
            buffer => Slice { buffer: base + buffer - 1, ..s },
        };
        for Step { kind, dst, src, third, data } in steps {
            self.emit(kind, placed(dst), src.map(placed), third.map(placed), data);
        }
        placed(output)
    }
}

/// Packs u16 in words, two each.
pub(super) fn words(halves: &[usize]) -> Vec<u32> {
    let half = |i: usize| halves.get(i).map_or(0, |half| *half as u32);
    (0..halves.len().div_ceil(2)).map(|i| half(2 * i) | half(2 * i + 1) << 16).collect()
}
