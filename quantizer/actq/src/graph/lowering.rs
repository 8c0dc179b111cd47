//! A network as an image's operations over buffers, before the buffers have places in the arena.
//!
//! Every value gets a buffer. Elementwise operations overwrite their input's buffer where nothing needs it any more.

use actq_kernels::image::OpKind;

use super::values::ValueId;

/// Index of a buffer.
pub type BufferId = usize;

/// An image's operation over `R`: parts of buffers while lowering, regions of the arena afterwards.
#[derive(Clone, Debug)]
pub struct Step<R> {
    /// What it does.
    pub kind: OpKind,
    /// Output, or the operand of an operation in place.
    pub dst: R,
    /// First source.
    pub src: Option<R>,
    /// Cell state or the state's gates.
    pub third: Option<R>,
    /// What its record points to.
    pub data: StepData,
}

/// What an operation's record points to.
#[derive(Clone, Debug)]
pub enum StepData {
    /// Nothing.
    None,
    /// Single constants, then arrays, in the order of [`OpKind`]'s description.
    Constants(Vec<f32>),
    /// Those of a denoising step, where the second becomes the arena offset of its noise.
    Denoise {
        /// See [`OpKind::Denoise`].
        constants: Vec<f32>,
        /// The first step's noise.
        noise: Option<Slice>,
    },
    /// A matrix of the graph, and its bias; empty: none.
    Product {
        /// Index.
        matrix: usize,
        /// One value per row.
        bias: Vec<f32>,
    },
}

/// Part of a buffer.
#[derive(Clone, Copy, Debug)]
pub struct Slice {
    /// The buffer.
    pub buffer: BufferId,
    /// First value.
    pub offset: usize,
    /// Values.
    pub len: usize,
}

/// How long a buffer's content is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lifetime {
    /// Between the first and the last operation that names it.
    Step,
    /// From the first operation that names it on: the output, a chunk of which is played over several steps, and what
    /// every denoising step reads.
    Output,
    /// In a place of its own, written before the first operation.
    Observation,
    /// In a place of its own, beyond the step, and zeroed by a reset.
    State,
}

/// A run of values in the arena.
#[derive(Clone, Copy, Debug)]
pub struct Buffer {
    /// Values.
    pub len: usize,
    /// How long they are needed.
    pub lifetime: Lifetime,
}

/// The operations so far, and where the values are.
#[derive(Debug)]
pub struct Lowering {
    /// The operations in order.
    pub steps: Vec<Step<Slice>>,
    /// The buffers.
    pub buffers: Vec<Buffer>,
    /// The buffer of each value.
    places: Vec<BufferId>,
    /// How many nodes still read each value; the network's output counts as one more.
    readers: Vec<usize>,
    /// What the network reads of the iterate.
    iterate: BufferId,
}

impl Lowering {
    /// Nothing but the observation; `readers` says how many nodes read each value.
    pub fn new(obs_len: usize, readers: Vec<usize>) -> Self {
        let observation = Buffer { len: obs_len, lifetime: Lifetime::Observation };
        Self { steps: Vec::new(), buffers: vec![observation], places: vec![0], readers, iterate: 0 }
    }

    /// A new buffer.
    pub fn buffer(&mut self, len: usize, lifetime: Lifetime) -> BufferId {
        self.buffers.push(Buffer { len, lifetime });
        self.buffers.len() - 1
    }

    /// All of a buffer.
    pub fn whole(&self, buffer: BufferId) -> Slice {
        Slice { buffer, offset: 0, len: self.buffers[buffer].len }
    }

    /// Noise, whose first values become the iterate, which is given; to be emitted first.
    pub fn noise(&mut self, noise_len: usize, len: usize) -> Slice {
        let noise = self.buffer(noise_len, Lifetime::Output);
        self.emit(OpKind::Noise, self.whole(noise), None, None, StepData::None);
        let iterate = Slice { len, ..self.whole(noise) };
        self.iterate = self.buffer(len, Lifetime::Output);
        iterate
    }

    /// The denoising steps begin with the next operation: what these values hold stays. Gives the number of operations
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

    /// What the network reads of the iterate.
    pub fn iterate(&self) -> BufferId {
        self.iterate
    }

    /// Where a value is, to be read.
    pub fn place(&self, value: ValueId) -> Slice {
        self.whole(self.places[value])
    }

    /// The next value is in `buffer`, and the node that gives it has read `inputs`.
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

    /// A buffer with `value` that may be overwritten: the value's own where this reader is the last, else a copy.
    pub fn private(&mut self, value: ValueId) -> BufferId {
        let place = self.places[value];
        if self.readers[value] <= 1 && self.buffers[place].lifetime == Lifetime::Step {
            return place;
        }
        let copy = self.buffer(self.buffers[place].len, Lifetime::Step);
        self.emit(OpKind::Copy, self.whole(copy), Some(self.whole(place)), None, StepData::None);
        copy
    }

    /// An operation that overwrites its input; gives the buffer.
    pub fn in_place(&mut self, input: ValueId, kind: OpKind, data: StepData) -> BufferId {
        let dst = self.private(input);
        self.emit(kind, self.whole(dst), None, None, data);
        dst
    }

    /// `dst = W src + bias`, or added to `dst`.
    pub fn product(&mut self, (matrix, bias): (usize, &[f32]), src: Slice, dst: BufferId, accumulate: bool) {
        let data = StepData::Product { matrix, bias: bias.to_vec() };
        self.emit(OpKind::Linear { accumulate }, self.whole(dst), Some(src), None, data);
    }
}
