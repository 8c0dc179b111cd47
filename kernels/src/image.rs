//! The image: one run of little-endian words, parsed once. `docs/FORMAT.md` has the byte tables.
//!
//! [`Image::new_checked`] verifies everything; afterwards no accessor panics or fails. Offsets in the image count 32-bit words
//! from its start, offsets in the arena (the scratch memory) count words too. Sums of offsets wrap: where flash has changed since
//! the check, an offset may be any word, and what is not there is refused where it is read.

use core::ops::Range;

use crate::error::ImageError;
use crate::layout::{Block, BlockShape, LAYOUT_STAMP, Width};
use crate::linear::{Matrix, RowBlock, fits_i32};
use crate::math::Function;
use crate::x::Plan;

/// Positions and constants of the header; what the writer and the parser share.
pub mod header {
    /// `ACTQ` in the first four bytes.
    pub const MAGIC: u32 = u32::from_le_bytes(*b"ACTQ");
    /// Format version.
    pub const VERSION: u16 = 2;
    /// Words of the header.
    pub const WORDS: usize = 32;
    /// Words before the checksummed part: magic, version, length, checksum.
    pub const UNCHECKED_WORDS: usize = 4;
    /// Words of an operation record.
    pub const OP_WORDS: usize = 4;
    /// Words of a matrix record.
    pub const MATRIX_WORDS: usize = 4;
    /// Words of a block record.
    pub const BLOCK_WORDS: usize = 4;
    /// The largest output of a matrix, in rows.
    pub const MAX_ROWS: usize = 4096;
    /// The most words of an arena: places in it are u16.
    pub const MAX_SCRATCH: usize = 0xffff;

    /// u16 version, u16 header words.
    pub const W_VERSION: usize = 1;
    /// Length of the image in bytes.
    pub const W_BYTES: usize = 2;
    /// CRC-32 (ISO-HDLC, as in zlib) of all bytes from word 4 on.
    pub const W_CRC: usize = 3;
    /// Kernel layout stamp.
    pub const W_LAYOUT: usize = 4;
    /// u8 kind, u8 zero, u16 number of operations.
    pub const W_KIND: usize = 5;
    /// Offset of the operation records.
    pub const W_OPS: usize = 6;
    /// u16 observation length, u16 action length.
    pub const W_SIZES: usize = 7;
    /// u16 actions in a chunk, u16 executed of them.
    pub const W_CHUNK: usize = 8;
    /// Arena length in words.
    pub const W_SCRATCH: usize = 9;
    /// u16 arena offset and u16 length of the state that a reset zeroes.
    pub const W_STATE: usize = 10;
    /// u16 arena offset of the observation, u16 of the network's output.
    pub const W_OBS_OUT: usize = 11;
    /// u16 arena offset of the action, u16 of the work area.
    pub const W_ACTION_WORK: usize = 12;
    /// u16 length of the work area, u16 flags of the action contract.
    pub const W_WORK_FLAGS: usize = 13;
    /// Offset of the action contract's arrays.
    pub const W_CONTRACT: usize = 14;
    /// f32 control rate in Hz.
    pub const W_RATE: usize = 15;
    /// Offset of the self-test vector.
    pub const W_SELF_TEST: usize = 16;
    /// u16 steps of the self-test, u16 bytes of the name.
    pub const W_STEPS_NAME: usize = 17;
    /// Offset of the policy's name.
    pub const W_NAME: usize = 18;
    /// Weights of the source policy's matrices.
    pub const W_WEIGHTS: usize = 19;
    /// SHA-256 of the source policy, 8 words.
    pub const W_DIGEST: usize = 20;
    /// Offset of the matrix records.
    pub const W_MATRICES: usize = 28;
    /// u16 number of matrices, u16 zero.
    pub const W_MATRIX_COUNT: usize = 29;

    /// Operation codes.
    pub mod op {
        /// `dst = clip((clip(src) - mean) * scale)`
        pub const NORMALIZE: u8 = 1;
        /// `dst = W src + b`
        pub const LINEAR: u8 = 2;
        /// `dst = f(dst)`
        pub const FUNCTION: u8 = 3;
        /// `dst = layer_norm(dst)`
        pub const LAYER_NORM: u8 = 4;
        /// `dst = rms_norm(dst)`
        pub const RMS_NORM: u8 = 5;
        /// `dst += src`
        pub const ADD: u8 = 6;
        /// `dst = src`
        pub const COPY: u8 = 7;
        /// LSTM cell
        pub const LSTM_CELL: u8 = 8;
        /// GRU cell
        pub const GRU_CELL: u8 = 9;
    }
}

use header as h;

/// The bits of infinity in bf16.
const BF16_INFINITY: u16 = (f32::INFINITY.to_bits() >> 16) as u16;

/// Word `i`; 0 behind the end.
fn word(words: &[u32], i: usize) -> u32 {
    u32::from_le(words.get(i).copied().unwrap_or(0))
}

fn low(word: u32) -> usize {
    (word & 0xffff) as usize
}

fn high(word: u32) -> usize {
    (word >> 16) as usize
}

/// What a policy's output means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One action per evaluation.
    Step,
    /// Several future actions per evaluation, of which the first few are executed.
    Chunk,
}

/// A region of the arena.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// First word.
    pub offset: usize,
    /// Words.
    pub len: usize,
}

impl Region {
    /// The words as an index range.
    pub fn range(self) -> core::ops::Range<usize> {
        self.offset..self.end()
    }

    /// The word behind the last one.
    pub(crate) fn end(self) -> usize {
        self.offset + self.len
    }

    fn overlaps(self, other: Self) -> bool {
        self.offset < other.end() && other.offset < self.end()
    }
}

/// What an operation does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpKind {
    /// `dst = clamp((clamp(src, ±pre_clip) - mean) * scale, ±clip)`. Constants: `pre_clip`, `clip`, infinite where there is no
    /// limit; arrays: `mean`, `scale`, the reciprocals of the standard deviation.
    Normalize,
    /// `dst = W src + b`
    Linear {
        /// `dst += W src + b` instead.
        accumulate: bool,
    },
    /// `dst = f(dst)`
    Function(Function),
    /// `dst = layer_norm(dst)`. Constant: what is added to the variance; arrays: weights, biases.
    LayerNorm,
    /// `dst = rms_norm(dst)`. Constant: what is added to the mean square; array: weights.
    RmsNorm,
    /// `dst += src`
    Add,
    /// `dst = src`
    Copy,
    /// An LSTM cell: `src` holds the four gates `[i f g o]`, `dst` is the hidden state, `third` the cell state.
    LstmCell,
    /// A GRU cell: `src` holds `W_ih x + b_ih`, `third` holds `W_hh h + b_hh`, each of gates `[r z n]`, `dst` is the state.
    GruCell,
}

/// What the record of a kind of operation holds.
#[derive(Debug)]
struct Form {
    /// With the detail 0.
    kind: OpKind,
    /// Of a function, [`Function::from_code`] decides.
    max_detail: u8,
    /// Lengths of `src` and of the third region in lengths of `dst`; 0 where there is none. (Linear has its own length.)
    src: u8,
    third: u8,
    /// Single constants, and arrays of the length of `dst` behind them.
    constants: u8,
    arrays: u8,
    /// Whether it works on what `dst` holds. (Of linear, the detail decides.)
    reads_dst: bool,
    /// Bits of the record's words behind the first that the operation does not use.
    unused: [u32; 3],
}

impl Form {
    const fn new(kind: OpKind, max_detail: u8, [src, third]: [u8; 2], [constants, arrays]: [u8; 2]) -> Self {
        const fn unless(used: bool, bits: u32) -> u32 {
            if used { 0 } else { bits }
        }
        let linear = matches!(kind, OpKind::Linear { .. });
        let unused = [
            unless(src > 0, !0xffff),
            unless(linear, 0xffff) | unless(linear || third > 0, !0xffff),
            unless(linear || constants > 0, !0),
        ];
        let reads_dst = !(linear || matches!(kind, OpKind::Normalize | OpKind::Copy | OpKind::LstmCell));
        Self { kind, max_detail, src, third, constants, arrays, reads_dst, unused }
    }
}

/// By operation code, from 1 on.
static FORMS: [Form; 9] = [
    Form::new(OpKind::Normalize, 0, [1, 0], [2, 2]),
    Form::new(OpKind::Linear { accumulate: false }, 1, [1, 0], [0, 0]),
    Form::new(OpKind::Function(Function::Relu), u8::MAX, [0, 0], [0, 0]),
    Form::new(OpKind::LayerNorm, 0, [0, 0], [1, 2]),
    Form::new(OpKind::RmsNorm, 0, [0, 0], [1, 1]),
    Form::new(OpKind::Add, 0, [1, 0], [0, 0]),
    Form::new(OpKind::Copy, 0, [1, 0], [0, 0]),
    Form::new(OpKind::LstmCell, 0, [4, 1], [0, 0]),
    Form::new(OpKind::GruCell, 0, [3, 3], [0, 0]),
];

/// An operation of an image.
#[derive(Clone, Copy, Debug)]
pub struct Op<'a> {
    /// What it does.
    pub kind: OpKind,
    /// [`Self::dst`], [`Self::src`], [`Self::third`].
    pub(crate) regions: [Region; 3],
    record: &'a [u32; h::OP_WORDS],
    form: &'static Form,
    /// The image's words.
    image: &'a [u32],
}

impl<'a> Op<'a> {
    /// What it writes. Where there is no [`Self::src`], it works in place.
    pub fn dst(&self) -> Region {
        self.regions[0]
    }

    /// What it reads, or empty.
    pub fn src(&self) -> Region {
        self.regions[1]
    }

    /// The cell's other region, or the work area of a linear operation, or empty.
    pub fn third(&self) -> Region {
        self.regions[2]
    }

    /// The weights of a linear operation.
    pub fn matrix(&self) -> Option<Matrix<'a>> {
        if self.is_linear() { self.linear_matrix().ok() } else { None }
    }

    /// As [`Self::matrix`], of a linear operation. (Within a checked image never an error.)
    pub(crate) fn linear_matrix(&self) -> Result<Matrix<'a>, ImageError> {
        matrix(self.image, self.data(), self.bias())
    }

    /// Offset of the biases of a linear operation; 0: none.
    fn bias(&self) -> usize {
        u32::from_le(self.record[2]) as usize
    }

    /// Single constant `i`: see [`OpKind`].
    pub fn constant(&self, i: usize) -> f32 {
        f32::from_bits(word(self.image, self.data().wrapping_add(i)))
    }

    /// Array `i` of f32 bits, of the length of `dst`: see [`OpKind`].
    pub fn array(&self, i: usize) -> &'a [u32] {
        self.part(i, &(0..self.dst().len))
    }

    /// What the operation can be cut into: elements, each once for every pass over them.
    pub(crate) fn units(&self) -> usize {
        self.dst().len
            * match self.kind {
                OpKind::LayerNorm => 3,
                OpKind::RmsNorm => 2,
                _ => 1,
            }
    }

    /// A range of array `i`; empty where that is not in the image.
    pub(crate) fn part(&self, i: usize, range: &Range<usize>) -> &'a [u32] {
        let before = usize::from(self.form.constants) + i * self.dst().len + range.start;
        section(self.image, self.data().wrapping_add(before), range.len()).unwrap_or_default()
    }

    /// Offset of the constants or of the matrix record.
    fn data(&self) -> usize {
        u32::from_le(self.record[3]) as usize
    }

    /// Whether the operation reads what its destination held.
    fn reads_dst(&self) -> bool {
        self.form.reads_dst || self.kind == OpKind::Linear { accumulate: true }
    }

    fn is_linear(&self) -> bool {
        matches!(self.kind, OpKind::Linear { .. })
    }
}

/// What stands between the network's output and the robot. Arrays hold f32 bits, one per action dimension, or are empty.
/// They apply in this order: `a = out * scale + offset`, then the limits, then the step limit against the last action.
#[derive(Clone, Copy, Debug)]
pub struct Contract<'a> {
    /// Factors.
    pub scale: &'a [u32],
    /// Offsets.
    pub offset: &'a [u32],
    /// Lower limits.
    pub low: &'a [u32],
    /// Upper limits.
    pub high: &'a [u32],
    /// Largest change from one action to the next.
    pub max_step: &'a [u32],
}

/// Arrays of the action contract.
const CONTRACT_ARRAYS: usize = 5;

/// A checked image.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    words: &'a [u32],
    /// The first of them.
    header: &'a [u32; h::WORDS],
}

impl<'a> Image<'a> {
    /// Parses `bytes`, which must start at a multiple of 4 in memory and hold exactly the image.
    ///
    /// Checks the checksum, every section, every operation, all constants, and that no row can overflow its int32
    /// accumulator for any activations. Time is linear in the image's length.
    #[inline(never)]
    pub fn new_checked(bytes: &'a [u8]) -> Result<Self, ImageError> {
        if bytes.as_ptr().align_offset(4) != 0 {
            return Err(ImageError::Misaligned);
        }
        if bytes.len() < h::WORDS * 4 {
            return Err(ImageError::TooShort);
        }
        let words: &[u32] = bytemuck::try_cast_slice(bytes).map_err(|_| ImageError::Length)?;
        let image = Self { words, header: words.first_chunk().ok_or(ImageError::TooShort)? };
        if image.head(0) != h::MAGIC {
            return Err(ImageError::Magic);
        }
        if low(image.head(h::W_VERSION)) != h::VERSION as usize || high(image.head(h::W_VERSION)) != h::WORDS {
            return Err(ImageError::Version);
        }
        if image.head(h::W_BYTES) as usize != bytes.len() {
            return Err(ImageError::Length);
        }
        if image.head(h::W_CRC) != checksum(bytes) {
            return Err(ImageError::Checksum);
        }
        if image.head(h::W_LAYOUT) != LAYOUT_STAMP {
            return Err(ImageError::Layout);
        }
        image.check()?;
        Ok(image)
    }

    /// An image whose memory may hold anything, as it does where flash has changed since the check: to test what becomes of it. A
    /// step of it ends with an action that means nothing or with [`crate::StepError::Damaged`]. `None` where the bytes are
    /// misaligned, no whole words, or shorter than a header.
    #[doc(hidden)]
    pub fn unchecked(bytes: &'a [u8]) -> Option<Self> {
        let words: &[u32] = bytemuck::try_cast_slice(bytes).ok()?;
        Some(Self { words, header: words.first_chunk()? })
    }

    fn word(&self, i: usize) -> u32 {
        word(self.words, i)
    }

    /// A word of the header.
    #[inline(always)]
    fn head(&self, i: usize) -> u32 {
        u32::from_le(self.header[i])
    }

    /// As [`section`]; empty where that refuses.
    fn section(&self, offset: usize, len: usize) -> &'a [u32] {
        section(self.words, offset, len).unwrap_or_default()
    }

    /// Length of an observation.
    pub fn obs_len(&self) -> usize {
        low(self.head(h::W_SIZES))
    }

    /// Length of an action.
    pub fn act_len(&self) -> usize {
        high(self.head(h::W_SIZES))
    }

    /// What the output means.
    pub fn kind(&self) -> Kind {
        if self.head(h::W_KIND) as u8 == 1 { Kind::Chunk } else { Kind::Step }
    }

    /// Actions in the network's output.
    pub fn chunk(&self) -> usize {
        low(self.head(h::W_CHUNK))
    }

    /// How many of a chunk's actions are executed before the network runs again.
    pub fn execute(&self) -> usize {
        high(self.head(h::W_CHUNK))
    }

    /// Words of scratch memory that a head needs.
    pub fn scratch_words(&self) -> usize {
        self.head(h::W_SCRATCH) as usize
    }

    /// Control rate in Hz that the policy was trained for.
    pub fn rate_hz(&self) -> f32 {
        f32::from_bits(self.head(h::W_RATE))
    }

    /// The policy's name.
    pub fn name(&self) -> &'a str {
        let words = self.section(self.head(h::W_NAME) as usize, self.name_len().div_ceil(4));
        let bytes = bytemuck::must_cast_slice(words).get(..self.name_len()).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Bytes of the name.
    fn name_len(&self) -> usize {
        high(self.head(h::W_STEPS_NAME))
    }

    /// SHA-256 of the source policy (policy.json, then policy.safetensors).
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = [0; 32];
        for (out, word) in digest.chunks_exact_mut(4).zip(self.header.iter().skip(h::W_DIGEST)) {
            out.copy_from_slice(&word.to_ne_bytes());
        }
        digest
    }

    /// Weights of the source policy's matrices, before anything was removed.
    pub fn source_weights(&self) -> usize {
        self.head(h::W_WEIGHTS) as usize
    }

    /// CRC-32 of the image, as in the header.
    pub fn crc(&self) -> u32 {
        self.head(h::W_CRC)
    }

    /// Bytes of the image.
    pub fn bytes(&self) -> usize {
        self.words.len() * 4
    }

    /// Arena region that a reset zeroes.
    pub fn state(&self) -> Region {
        Region { offset: low(self.head(h::W_STATE)), len: high(self.head(h::W_STATE)) }
    }

    /// Arena region of the observation.
    pub fn observation(&self) -> Region {
        Region { offset: low(self.head(h::W_OBS_OUT)), len: self.obs_len() }
    }

    /// Arena region of the network's output.
    pub fn output(&self) -> Region {
        Region { offset: high(self.head(h::W_OBS_OUT)), len: self.chunk() * self.act_len() }
    }

    /// Arena region of the action.
    pub fn action(&self) -> Region {
        Region { offset: low(self.head(h::W_ACTION_WORK)), len: self.act_len() }
    }

    /// Arena region in which activations are prepared.
    pub fn work(&self) -> Region {
        Region { offset: high(self.head(h::W_ACTION_WORK)), len: low(self.head(h::W_WORK_FLAGS)) }
    }

    /// Number of operations.
    pub fn op_count(&self) -> usize {
        high(self.head(h::W_KIND))
    }

    /// The operations in order.
    pub fn ops(&self) -> impl Iterator<Item = Op<'a>> + use<'a> {
        let image = *self;
        (0..self.op_count()).filter_map(move |i| image.op(i).ok())
    }

    /// The action contract.
    pub fn contract(&self) -> Contract<'a> {
        let [scale, offset, low, high, max_step] = self.contract_arrays();
        Contract { scale, offset, low, high, max_step }
    }

    /// The arrays of the action contract, in the order in which they apply.
    pub fn contract_arrays(&self) -> [&'a [u32]; CONTRACT_ARRAYS] {
        let mut offset = self.head(h::W_CONTRACT) as usize;
        core::array::from_fn(|which| {
            let len = if self.has_contract(which) { self.act_len() } else { 0 };
            let array = self.section(offset, len);
            offset += array.len();
            array
        })
    }

    /// The contract of action `i`; numbers that change nothing stand for the arrays that it has not.
    pub(crate) fn contract_of(&self, i: usize) -> [f32; CONTRACT_ARRAYS] {
        let mut numbers = [1.0, -0.0, f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY];
        let (mut flags, len) = (high(self.head(h::W_WORK_FLAGS)), self.act_len());
        let mut at = (self.head(h::W_CONTRACT) as usize).wrapping_add(i);
        for number in &mut numbers {
            if flags & 1 == 1 {
                *number = f32::from_bits(self.word(at));
                at = at.wrapping_add(len);
            }
            flags >>= 1;
        }
        numbers
    }

    fn has_contract(&self, which: usize) -> bool {
        high(self.head(h::W_WORK_FLAGS)) >> which & 1 == 1
    }

    /// Steps of the self-test vector.
    pub fn self_test_steps(&self) -> usize {
        low(self.head(h::W_STEPS_NAME))
    }

    /// Observation (f32 bits) and expected action (f32 bits) of a self-test step, played in order after a reset.
    pub fn self_test(&self, step: usize) -> Option<(&'a [u32], &'a [u32])> {
        if step >= self.self_test_steps() {
            return None;
        }
        let (obs, act) = (self.obs_len(), self.act_len());
        let offset = (self.head(h::W_SELF_TEST) as usize).wrapping_add(step * (obs + act));
        self.section(offset, obs + act).split_at_checked(obs)
    }

    /// Operation `i`, refused where its record says something impossible. (Within a checked image every record parses.)
    pub(crate) fn op(&self, i: usize) -> Result<Op<'a>, ImageError> {
        let op = record(self.words, (self.head(h::W_OPS) as usize).wrapping_add(i * h::OP_WORDS))?;
        let [head, places, lengths, data] = op.map(u32::from_le);
        let (code, detail, len) = (head as u8, (head >> 8) as u8, high(head));
        let form = FORMS.get(usize::from(code).wrapping_sub(1)).ok_or(ImageError::Op)?;
        let [mut src, third] = [form.src, form.third].map(|times| len * usize::from(times));
        let mut third = Region { offset: high(lengths), len: third };
        let kind = match form.kind {
            OpKind::Linear { .. } => {
                (src, third) = (high(self.word(data as usize)), self.work());
                OpKind::Linear { accumulate: detail == 1 }
            }
            OpKind::Function(_) => OpKind::Function(Function::from_code(detail).ok_or(ImageError::Op)?),
            kind => kind,
        };
        let dst = Region { offset: low(places), len };
        let src = Region { offset: high(places), len: src };
        Ok(Op { kind, regions: [dst, src, third], record: op, form, image: self.words })
    }

    /// Matrices of the image.
    fn matrix_count(&self) -> usize {
        low(self.head(h::W_MATRIX_COUNT))
    }

    /// Offset of matrix record `i`.
    fn matrix_at(&self, i: usize) -> usize {
        (self.head(h::W_MATRICES) as usize).wrapping_add(i * h::MATRIX_WORDS)
    }

    fn check(&self) -> Result<(), ImageError> {
        let reserved = high(self.head(h::W_MATRIX_COUNT)) as u32 | self.header[30] | self.header[31];
        if reserved != 0
            || (self.head(h::W_KIND) >> 8) as u8 != 0
            || high(self.head(h::W_WORK_FLAGS)) >> CONTRACT_ARRAYS != 0
        {
            return Err(ImageError::Reserved);
        }
        match (self.head(h::W_KIND) as u8, self.chunk(), self.execute()) {
            (0, 1, 1) => {}
            (1, chunk, execute) if (1..=chunk).contains(&execute) => {}
            (0 | 1, ..) => return Err(ImageError::Chunk),
            _ => return Err(ImageError::Kind),
        }
        if self.obs_len() == 0 || self.act_len() == 0 || self.op_count() == 0 {
            return Err(ImageError::Shape);
        }
        // State, observation, what operations write, action, work area: in this order and without a gap. (`check_sections` sees
        // to the middle.)
        let (action, work) = (self.action(), self.work());
        if self.state().offset != 0
            || self.observation().offset != self.state().end()
            || self.output().offset < self.observation().end()
            || work.offset != action.end()
            || work.end() != self.scratch_words()
            || work.end() > h::MAX_SCRATCH
        {
            return Err(ImageError::Arena);
        }
        if !is_positive(self.rate_hz()) {
            return Err(ImageError::Constant);
        }
        // A head that tests nothing would report success.
        if self.self_test_steps() == 0 {
            return Err(ImageError::SelfTest);
        }
        self.check_sections()
    }

    /// The sections, in the order in which they stand, and what they hold.
    fn check_sections(&self) -> Result<(), ImageError> {
        let front = &mut Front { words: self.words, at: h::WORDS };
        for i in 0..self.matrix_count() {
            check_matrix(self.matrix_at(i), front, self.work().len)?;
        }
        front.take(self.head(h::W_MATRICES) as usize, self.matrix_count() * h::MATRIX_WORDS)?;
        let mut written = self.observation().end();
        for i in 0..self.op_count() {
            written = self.check_op(i, front, written)?;
        }
        if self.output().end() > written {
            return Err(ImageError::Unwritten);
        }
        if written != self.action().offset {
            return Err(ImageError::Arena);
        }
        front.take(self.head(h::W_OPS) as usize, self.op_count() * h::OP_WORDS)?;
        self.check_contract(front)?;
        let name = front.take(self.head(h::W_NAME) as usize, self.name_len().div_ceil(4))?;
        if !is_text(bytemuck::must_cast_slice(name).get(..self.name_len()).unwrap_or_default()) {
            return Err(ImageError::Name);
        }
        // The arena holds both lengths, so that the product fits 32 bits.
        let self_test = self.self_test_steps() * (self.obs_len() + self.act_len());
        front.take_finite(self.head(h::W_SELF_TEST) as usize, self_test)
    }

    fn check_contract(&self, front: &mut Front<'a>) -> Result<(), ImageError> {
        let arrays = (0..CONTRACT_ARRAYS).filter(|which| self.has_contract(*which)).count();
        front.take_finite(self.head(h::W_CONTRACT) as usize, arrays * self.act_len())?;
        for i in 0..self.act_len() {
            let [_, _, low, high, max_step] = self.contract_of(i);
            if low > high {
                return Err(ImageError::Limits);
            }
            if max_step < 0.0 {
                return Err(ImageError::Constant);
            }
        }
        Ok(())
    }

    /// Checks an operation before which the first `written` words of the arena hold something of the step; gives their number
    /// behind it.
    #[inline(never)]
    fn check_op(&self, i: usize, front: &mut Front<'a>, written: usize) -> Result<usize, ImageError> {
        let op = self.op(i);
        let op = op.as_ref().map_err(|e| *e)?;
        let Form { max_detail, constants, arrays, unused, .. } = op.form;
        let [head, places, lengths, data] = op.record.map(u32::from_le);
        let n = op.dst().len;
        if (places & unused[0] | lengths & unused[1] | data & unused[2]) != 0 || (head >> 8) as u8 > *max_detail {
            return Err(ImageError::Reserved);
        }
        if n == 0 {
            return Err(ImageError::Shape);
        }
        if op.is_linear() {
            let behind = op.data().wrapping_sub(self.matrix_at(0));
            if !behind.is_multiple_of(h::MATRIX_WORDS) || behind / h::MATRIX_WORDS >= self.matrix_count() {
                return Err(ImageError::Matrix);
            }
            // The matrix itself was checked with the others.
            if low(self.word(op.data())) != n {
                return Err(ImageError::Shape);
            }
            if op.bias() != 0 {
                front.take_finite(op.bias(), n)?;
            }
        } else if *constants > 0 {
            let [constants, arrays] = [*constants, *arrays].map(usize::from);
            for constant in front.take(op.data(), constants)? {
                // Above 0, and finite but for limits: positive numbers are in the order of their bits.
                let infinity = f32::INFINITY.to_bits() + u32::from(op.kind == OpKind::Normalize);
                if u32::from_le(*constant).wrapping_sub(1) >= infinity - 1 {
                    return Err(ImageError::Constant);
                }
            }
            front.take_finite(op.data() + constants, arrays * n)?;
        }
        let [dst, src, third] = op.regions;
        if dst.overlaps(src) || dst.overlaps(third) || src.overlaps(third) {
            return Err(ImageError::Overlap);
        }
        // Nothing is read that no operation of this step has written: what a step before or the caller left there, or the work
        // area, where backends differ.
        let third = if op.is_linear() { Region::default() } else { third };
        let old = if op.reads_dst() { dst.end() } else { 0 };
        if src.end().max(third.end()).max(old) > written {
            return Err(ImageError::Unwritten);
        }
        if dst.offset > written {
            return Err(ImageError::Arena);
        }
        Ok(written.max(dst.end()))
    }
}

/// Takes sections in the order in which they stand. None shares a word with another, so that what is checked is no longer than
/// the image.
struct Front<'a> {
    words: &'a [u32],
    /// The end of the last one.
    at: usize,
}

impl<'a> Front<'a> {
    #[inline(always)]
    fn take(&mut self, offset: usize, len: usize) -> Result<&'a [u32], ImageError> {
        self.next(offset, len).ok_or(ImageError::Section)
    }

    #[inline(never)]
    fn next(&mut self, offset: usize, len: usize) -> Option<&'a [u32]> {
        let section = section(self.words, offset, len).filter(|_| offset >= self.at)?;
        self.at = offset + len;
        Some(section)
    }

    /// As [`Self::take`], of f32 constants, refused where one is not finite.
    #[inline(never)]
    fn take_finite(&mut self, offset: usize, len: usize) -> Result<(), ImageError> {
        let constants = self.take(offset, len)?;
        let finite = constants.iter().all(|&w| f32::from_bits(u32::from_le(w)).is_finite());
        if finite { Ok(()) } else { Err(ImageError::Constant) }
    }
}

/// The matrix of the record at `at` with the biases at `bias` (0: none), refused where the record says something impossible.
fn matrix(image: &[u32], at: usize, bias: usize) -> Result<Matrix<'_>, ImageError> {
    let [size, levels, blocks, records] = record(image, at)?.map(u32::from_le);
    let (rows, cols, group, x_max) = (low(size), high(size), low(levels), high(levels) as u16);
    if rows == 0 || rows > h::MAX_ROWS || cols == 0 {
        return Err(ImageError::Shape);
    }
    if !matches!(group, 0 | 32 | 64 | 128) {
        return Err(ImageError::Group);
    }
    if x_max == 0 || x_max > i16::MAX as u16 {
        return Err(ImageError::Constant);
    }
    if high(blocks) != 0 {
        return Err(ImageError::Reserved);
    }
    let section = |offset, len| section(image, offset, len).ok_or(ImageError::Section);
    let bias = if bias == 0 { &[] } else { section(bias, rows)? };
    let records = section(records as usize, low(blocks) * h::BLOCK_WORDS)?;
    Ok(Matrix { rows, cols, group, x_max, bias, image, records })
}

/// The matrix of the record at `at`: its blocks, the places of their rows, their sums, and the words of the `work` area that its
/// input takes.
#[inline(never)]
fn check_matrix(at: usize, front: &mut Front<'_>, work: usize) -> Result<(), ImageError> {
    let matrix = &matrix(front.words, at, 0);
    let matrix = matrix.as_ref().map_err(|e| *e)?;
    let mut seen = [0u32; h::MAX_ROWS / 32];
    let mut first_row = 0;
    for record in matrix.records.as_chunks().0 {
        let rows = row_block(matrix, record, first_row);
        let rows = rows.as_ref().map_err(|e| *e)?;
        // Weights, scales and index stand behind each other.
        let [_, weights, scales, index] = record.map(|word| u32::from_le(word) as usize);
        let to_scales = rows.block.words().len();
        let to_index = to_scales + rows.scales.len();
        if scales != weights + to_scales || index != 0 && index != weights + to_index {
            return Err(ImageError::Section);
        }
        front.take(weights, to_index + rows.index.len())?;
        // Magnitudes compare as their bits, and a sign is above them all.
        if bytemuck::must_cast_slice(rows.scales).iter().any(|scale: &u16| u16::from_le(*scale) >= BF16_INFINITY) {
            return Err(ImageError::Constant);
        }
        first_row += rows.block.shape().rows;
        for row in 0..rows.block.shape().rows {
            let output = rows.output(row);
            let word = seen.get_mut(output / 32).ok_or(ImageError::Index)?;
            if output >= matrix.rows || *word >> (output % 32) & 1 == 1 {
                return Err(ImageError::Index);
            }
            *word |= 1 << (output % 32);
        }
        if room(&rows.block) > work {
            return Err(ImageError::Arena);
        }
        if !fits_i32(&rows.block, matrix.x_max) {
            return Err(ImageError::Overflow);
        }
    }
    front.take(word(front.words, at + 3) as usize, matrix.records.len())?;
    Ok(())
}

/// Words that preparing an input for the block takes.
#[inline(never)]
fn room(block: &Block<'_>) -> usize {
    Plan::of(block).room(block.shape().cols)
}

/// `len` words at `offset`, refused where they are not all in the image and behind its header.
#[inline(never)]
fn section(image: &[u32], offset: usize, len: usize) -> Option<&[u32]> {
    behind(image, offset).get(..len)
}

/// The record at `offset`.
fn record<const N: usize>(image: &[u32], offset: usize) -> Result<&[u32; N], ImageError> {
    behind(image, offset).first_chunk().ok_or(ImageError::Section)
}

/// What stands in the image from `offset` on, behind its header.
fn behind(image: &[u32], offset: usize) -> &[u32] {
    if offset < h::WORDS { &[] } else { image.get(offset..).unwrap_or_default() }
}

/// Whether a number is above 0 and finite.
fn is_positive(x: f32) -> bool {
    (1..f32::INFINITY.to_bits()).contains(&x.to_bits())
}

/// Whether bytes are UTF-8 without control characters (C0, DEL, C1), which would steer the terminal that a name is printed on.
/// In a quarter of the code of `core::str::from_utf8`.
fn is_text(bytes: &[u8]) -> bool {
    // Bytes that must follow, the code point so far, and the least one that needs so many bytes and is no control character.
    let (mut more, mut point, mut least) = (0, 0u32, 0);
    for &byte in bytes {
        // In a lead byte as many as the sequence has bytes, in the others 1; in an ASCII character 0.
        let ones = byte.leading_ones();
        if more > 0 {
            (more, point) = (more - 1, point << 6 | u32::from(byte & 0x3f));
            let surrogate = point >> 11 == 0xd800 >> 11;
            if ones != 1 || more == 0 && (point < least || point > 0x10_ffff || surrogate) {
                return false;
            }
        } else if ones == 0 {
            if !(0x20..0x7f).contains(&byte) {
                return false;
            }
        } else {
            if !(2..=4).contains(&ones) {
                return false;
            }
            (more, point) = (ones - 1, u32::from(byte & 0x7f >> ones));
            least = (1 << (5 * ones - 4)).max(0xa0);
        }
    }
    more == 0
}

/// The block of a record, refused where the record says something impossible.
#[inline(never)]
pub(crate) fn row_block<'a>(
    matrix: &Matrix<'a>,
    record: &[u32; h::BLOCK_WORDS],
    first_row: usize,
) -> Result<RowBlock<'a>, ImageError> {
    let [head, weights, scales, index] = record.map(u32::from_le);
    let width = Width::from_bits(head & 0xff).ok_or(ImageError::Width)?;
    let lanes = matrix.lanes();
    if (head >> 8) as u8 != lanes.code() {
        return Err(ImageError::Lanes);
    }
    let rows = high(head);
    let shape = BlockShape { width, lanes, rows, cols: matrix.cols, group: matrix.group };
    if !shape.is_valid() || rows > matrix.rows {
        return Err(ImageError::Shape);
    }
    let halves = |offset: u32| section(matrix.image, offset as usize, rows.div_ceil(2)).ok_or(ImageError::Section);
    let scales = halves(scales)?;
    let index = if index == 0 { &[] } else { halves(index)? };
    match Block::leading(shape, behind(matrix.image, weights as usize)) {
        Some(block) => Ok(RowBlock { block, scales, index, first_row }),
        None => Err(ImageError::Section),
    }
}

impl<'a> Matrix<'a> {
    /// The blocks in the order of the image.
    pub fn blocks(&self) -> impl Iterator<Item = RowBlock<'a>> + use<'a> {
        let matrix = *self;
        let mut first_row = 0;
        self.records.as_chunks().0.iter().filter_map(move |record| {
            let rows = row_block(&matrix, record, first_row).ok()?;
            first_row += rows.block.shape().rows;
            Some(rows)
        })
    }

    /// Bytes of everything that describes the weights ([`block_bytes`]). Biases and the matrix record are not counted.
    pub fn weight_bytes(&self) -> usize {
        self.blocks().map(|rows| block_bytes(rows.block.shape(), !rows.index.is_empty())).sum()
    }

    /// Bias of output `row`; 0 where the matrix has none.
    pub fn bias(&self, row: usize) -> f32 {
        self.bias.get(row).map_or(0.0, |w| f32::from_bits(u32::from_le(*w)))
    }
}

/// Bytes that a block takes: packed words with their padding and group scales, row scales, output indexes where the block is
/// `indexed`, and the block record.
pub const fn block_bytes(shape: BlockShape, indexed: bool) -> usize {
    let halves = shape.rows.div_ceil(2) * if indexed { 2 } else { 1 };
    4 * (shape.words() + halves + h::BLOCK_WORDS)
}

/// CRC-32 (ISO-HDLC) of an image's bytes behind the fields that it does not cover.
pub fn checksum(bytes: &[u8]) -> u32 {
    const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    CRC.checksum(bytes.get(h::UNCHECKED_WORDS * 4..).unwrap_or(&[]))
}

/// Packs u16 values two a word, as scales and indexes stand in the image.
pub fn half_words(values: &[u16]) -> impl Iterator<Item = u32> + '_ {
    values.chunks(2).map(|pair| pair.iter().rev().fold(0u32, |word, v| word << 16 | u32::from(*v)))
}

#[cfg(test)]
mod tests {
    use super::is_text;

    /// All sequences of up to four bytes from those where the rules change.
    #[test]
    fn text_is_utf8_without_control_characters() {
        let edges = [
            0x00, 0x1f, 0x20, 0x7e, 0x7f, 0x80, 0x8f, 0x90, 0x9f, 0xa0, 0xbf, 0xc0, 0xc1, 0xc2, 0xdf, 0xe0, 0xe1, 0xec,
            0xed, 0xee,
        ];
        let edges = [&edges[..], &[0xef, 0xf0, 0xf1, 0xf3, 0xf4, 0xf5, 0xf7, 0xf8, 0xff]].concat();
        let mut sequences = vec![Vec::new()];
        for _ in 0..4 {
            let longer = sequences.iter().flat_map(|s: &Vec<u8>| edges.iter().map(|b| [&s[..], &[*b]].concat()));
            sequences = longer.collect();
            for bytes in &sequences {
                let expected = core::str::from_utf8(bytes).is_ok_and(|text| !text.contains(char::is_control));
                assert_eq!(is_text(bytes), expected, "{bytes:x?}");
            }
        }
    }
}
