//! A network as an image's operations over buffers, before the buffers have offsets in the arena.
//!
//! Every value gets a buffer. Elementwise operations overwrite their input's buffer if no later operation needs it.

use actq_kernels::image::OpKind;

use super::values::ValueId;

/// Index of a buffer.
pub type BufferId = usize;

/// An image's operation over `R`: parts of buffers during lowering, then regions of the arena.
#[derive(Clone, Debug)]
pub struct Step<R> {
    /// Kind of the operation.
    pub kind: OpKind,
    /// Output, or the operand of an operation in place.
    pub dst: R,
    /// First source.
    pub src: Option<R>,
    /// Cell state, gates of the state, values of attention, or its cache.
    pub third: Option<R>,
    /// Data that its record points to.
    pub data: StepData,
}

/// Data that an operation's record points to.
#[derive(Clone, Debug)]
pub enum StepData {
    /// No data.
    None,
    /// Single constants, then arrays, in the order of [`OpKind`]'s description.
    Constants(Vec<f32>),
    /// Words in the order of docs/FORMAT.md.
    Words(Vec<u32>),
    /// Constants of a denoising step; the second becomes the arena offset of its noise.
    Denoise {
        /// Constants in the order of [`OpKind::Denoise`].
        constants: Vec<f32>,
        /// Noise of the first step.
        noise: Option<Slice>,
    },
    /// A matrix of the graph and its bias; empty: none.
    Product {
        /// Index of the matrix.
        matrix: usize,
        /// One value per row.
        bias: Vec<f32>,
    },
}

/// Part of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slice {
    /// The buffer.
    pub buffer: BufferId,
    /// First value.
    pub offset: usize,
    /// Values.
    pub len: usize,
}

impl Slice {
    /// Returns `true` if both have a value in common.
    pub fn overlaps(self, other: Self) -> bool {
        self.buffer == other.buffer && self.offset < other.offset + other.len && other.offset < self.offset + self.len
    }
}

/// Lifetime of a buffer's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifetime {
    /// From the first to the last operation that names it.
    Step,
    /// From the first operation that names it to the end of the step, and on: the output, a chunk of which plays over
    /// several steps, and values that every denoising step reads.
    Output,
    /// At an offset of its own; written before the first operation.
    Observation,
    /// At an offset of its own; kept over steps and zeroed by a reset.
    State,
    /// At an offset of its own; a cache of the prefix, which the head's caller writes.
    Prefix,
    /// Nowhere: keys or values of the prefix, which only attention reads.
    Outside,
}

/// A run of values in the arena.
#[derive(Clone, Copy, Debug)]
pub struct Buffer {
    /// Values.
    pub len: usize,
    /// Lifetime of the content.
    pub lifetime: Lifetime,
}

/// The operations so far, and the buffers of the values.
#[derive(Debug)]
pub struct Lowering {
    /// The operations in order.
    pub steps: Vec<Step<Slice>>,
    /// The buffers.
    pub buffers: Vec<Buffer>,
    /// The buffer of each value.
    places: Vec<BufferId>,
    /// Nodes that still read each value; the network's output counts as one more.
    readers: Vec<usize>,
    /// Buffer of the value that the network reads of the iterate.
    iterate: BufferId,
    /// Caches of attention that need not be written again, by their keys, values and heads.
    caches: Vec<([usize; 3], BufferId)>,
    /// Words of the work area that operations without a matrix need.
    pub work_words: usize,
}

impl Lowering {
    /// Starts with the observation alone; `readers` holds how many nodes read each value.
    pub fn new(obs_len: usize, readers: Vec<usize>) -> Self {
        let observation = Buffer { len: obs_len, lifetime: Lifetime::Observation };
        Self::inside(Vec::new(), vec![observation], 0, readers)
    }

    /// Starts with buffers and operations around a network, whose observation is in `observation`.
    pub fn inside(steps: Vec<Step<Slice>>, buffers: Vec<Buffer>, observation: BufferId, readers: Vec<usize>) -> Self {
        Self { steps, buffers, places: vec![observation], readers, iterate: 0, caches: Vec::new(), work_words: 0 }
    }

    /// Adds a buffer.
    pub fn buffer(&mut self, len: usize, lifetime: Lifetime) -> BufferId {
        self.buffers.push(Buffer { len, lifetime });
        self.buffers.len() - 1
    }

    /// Returns the slice of a whole buffer.
    pub fn whole(&self, buffer: BufferId) -> Slice {
        Slice { buffer, offset: 0, len: self.buffers[buffer].len }
    }

    /// Emits the noise, whose first values become the iterate, and returns the iterate; to be called first.
    pub fn noise(&mut self, noise_len: usize, len: usize) -> Slice {
        let noise = self.buffer(noise_len, Lifetime::Output);
        self.emit(OpKind::Noise, self.whole(noise), None, None, StepData::None);
        let iterate = Slice { len, ..self.whole(noise) };
        self.iterate = self.buffer(len, Lifetime::Output);
        iterate
    }

    /// Begins the denoising steps and keeps the values in `read` for all of them. Returns the number of operations
    /// before.
    pub fn begin_steps(&mut self, iterate: Slice, read: &[ValueId]) -> usize {
        self.emit(OpKind::Copy, self.whole(self.iterate), Some(iterate), None, StepData::None);
        for &value in read {
            let buffer = &mut self.buffers[self.places[value]];
            if buffer.lifetime == Lifetime::Step {
                buffer.lifetime = Lifetime::Output;
            }
        }
        self.steps.len()
    }

    /// Returns the cache with these keys, values and heads, if an operation before has written it.
    pub fn cache(&self, of: [usize; 3]) -> Option<BufferId> {
        self.caches.iter().find(|(known, _)| *known == of).map(|(_, cache)| *cache)
    }

    /// Records that a cache holds these keys, values and heads for all later operations.
    pub fn add_cache(&mut self, of: [usize; 3], cache: BufferId) {
        self.caches.push((of, cache));
    }

    /// Returns the buffer of the value that the network reads of the iterate.
    pub fn iterate(&self) -> BufferId {
        self.iterate
    }

    /// Returns the slice of a value, for reading.
    pub fn place(&self, value: ValueId) -> Slice {
        self.whole(self.places[value])
    }

    /// Records that the next value is in `buffer` and that its node has read `inputs`.
    pub fn finish_node(&mut self, buffer: BufferId, inputs: &[ValueId]) {
        self.places.push(buffer);
        for &value in inputs {
            self.readers[value] -= 1;
        }
    }

    /// Appends an operation.
    pub fn emit(&mut self, kind: OpKind, dst: Slice, src: Option<Slice>, third: Option<Slice>, data: StepData) {
        self.steps.push(Step { kind, dst, src, third, data });
    }

    /// Returns a buffer with `value` that may be overwritten: the value's own if this is its last reader, else a copy.
    pub fn private(&mut self, value: ValueId) -> BufferId {
        let place = self.places[value];
        if self.readers[value] <= 1 && self.buffers[place].lifetime == Lifetime::Step {
            return place;
        }
        let copy = self.buffer(self.buffers[place].len, Lifetime::Step);
        self.emit(OpKind::Copy, self.whole(copy), Some(self.whole(place)), None, StepData::None);
        copy
    }

    /// Emits an operation that overwrites its input, and returns the buffer.
    pub fn in_place(&mut self, input: ValueId, kind: OpKind, data: StepData) -> BufferId {
        let dst = self.private(input);
        self.emit(kind, self.whole(dst), None, None, data);
        dst
    }

    /// Emits `dst = W src + bias`, or adds it to `dst`.
    pub fn product(&mut self, (matrix, bias): (usize, &[f32]), src: Slice, dst: BufferId, accumulate: bool) {
        let data = StepData::Product { matrix, bias: bias.to_vec() };
        self.emit(OpKind::Linear { accumulate, in_place: false }, self.whole(dst), Some(src), None, data);
    }
}
