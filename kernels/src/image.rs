//! The image: one run of little-endian words, parsed once. `docs/FORMAT.md` has the byte tables.
//!
//! [`Image::new_checked`] verifies everything; afterwards no accessor panics or fails. Offsets in the image count 32-bit words
//! from its start, offsets in the arena (the scratch memory) count words too.

use crate::error::ImageError;
use crate::format::{Block, BlockShape, LAYOUT_STAMP, Lanes, Width};
use crate::linear::{Matrix, RowBlock, worst_case, worst_case_bound};
use crate::math::Function;

/// Positions and constants of the header; what the writer and the parser share.
pub mod header {
    /// `ACTQ` in the first four bytes.
    pub const MAGIC: u32 = u32::from_le_bytes(*b"ACTQ");
    /// Format version.
    pub const VERSION: u16 = 1;
    /// Words of the header.
    pub const WORDS: usize = 32;
    /// Words before the checksummed part: magic, version, length, checksum.
    pub const UNCHECKED_WORDS: usize = 4;
    /// Words of an operation record.
    pub const OP_WORDS: usize = 4;
    /// Words of a matrix record before its block records.
    pub const MATRIX_WORDS: usize = 4;
    /// Words of a block record.
    pub const BLOCK_WORDS: usize = 4;
    /// The largest output of a matrix, in rows.
    pub const MAX_ROWS: usize = 4096;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First word.
    pub offset: usize,
    /// Words.
    pub len: usize,
}

impl Region {
    /// The words as an index range.
    pub fn range(self) -> core::ops::Range<usize> {
        self.offset..self.offset + self.len
    }

    fn overlaps(self, other: Self) -> bool {
        self.offset < other.offset + other.len && other.offset < self.offset + self.len
    }
}

/// An operation with its constants.
#[derive(Clone, Copy, Debug)]
pub enum Op<'a> {
    /// `dst = clamp((clamp(src, ±pre_clip) - mean) * scale, ±clip)`
    Normalize {
        /// Input.
        src: Region,
        /// Output of the same length.
        dst: Region,
        /// Means (f32 bits).
        mean: &'a [u32],
        /// Reciprocals of the standard deviation (f32 bits).
        scale: &'a [u32],
        /// Limit before; infinite where there is none.
        pre_clip: f32,
        /// Limit after; infinite where there is none.
        clip: f32,
    },
    /// `dst = W src + b`, or `dst += W src + b`
    Linear {
        /// Input.
        src: Region,
        /// Output.
        dst: Region,
        /// The weights.
        matrix: Matrix<'a>,
        /// Add to what `dst` holds.
        accumulate: bool,
    },
    /// `dst = f(dst)`
    Function {
        /// In place.
        dst: Region,
        /// Which one.
        function: Function,
    },
    /// `dst = layer_norm(dst)`
    LayerNorm {
        /// In place.
        dst: Region,
        /// Weights (f32 bits).
        weight: &'a [u32],
        /// Biases (f32 bits).
        bias: &'a [u32],
        /// Added to the variance.
        eps: f32,
    },
    /// `dst = rms_norm(dst)`
    RmsNorm {
        /// In place.
        dst: Region,
        /// Weights (f32 bits).
        weight: &'a [u32],
        /// Added to the mean square.
        eps: f32,
    },
    /// `dst += src`
    Add {
        /// Addend.
        src: Region,
        /// In place.
        dst: Region,
    },
    /// `dst = src`
    Copy {
        /// From.
        src: Region,
        /// To.
        dst: Region,
    },
    /// An LSTM cell: `src` holds the four gates, `dst` is the hidden state, `cell` the cell state.
    LstmCell {
        /// Gates `[i f g o]`.
        src: Region,
        /// Hidden state.
        dst: Region,
        /// Cell state.
        cell: Region,
    },
    /// A GRU cell: `src` holds `W_ih x + b_ih`, `hidden` holds `W_hh h + b_hh`, `dst` is the state.
    GruCell {
        /// Gates `[r z n]` of the input.
        src: Region,
        /// State.
        dst: Region,
        /// Gates `[r z n]` of the state.
        hidden: Region,
    },
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

    fn word(&self, i: usize) -> u32 {
        u32::from_le(self.words.get(i).copied().unwrap_or(0))
    }

    /// A word of the header.
    #[inline(always)]
    fn head(&self, i: usize) -> u32 {
        u32::from_le(self.header[i])
    }

    fn low(&self, i: usize) -> usize {
        low(self.word(i))
    }

    fn high(&self, i: usize) -> usize {
        high(self.word(i))
    }

    fn float(&self, i: usize) -> f32 {
        f32::from_bits(self.word(i))
    }

    #[inline(never)]
    fn section(&self, offset: usize, len: usize) -> &'a [u32] {
        offset.checked_add(len).and_then(|end| self.words.get(offset..end)).unwrap_or(&[])
    }

    /// `len` words at `offset`, refused where they are not all in the image.
    #[inline(never)]
    fn checked(&self, offset: usize, len: usize) -> Result<&'a [u32], ImageError> {
        let section = self.section(offset, len);
        if section.len() == len && (len == 0 || offset >= h::WORDS) { Ok(section) } else { Err(ImageError::Section) }
    }

    /// `len` f32 constants at `offset`, refused where one is not finite.
    #[inline(never)]
    fn constants(&self, offset: usize, len: usize) -> Result<&'a [u32], ImageError> {
        let section = self.checked(offset, len)?;
        if section.iter().all(|&w| f32::from_bits(u32::from_le(w)).is_finite()) {
            Ok(section)
        } else {
            Err(ImageError::Constant)
        }
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
        let len = high(self.head(h::W_STEPS_NAME));
        let bytes: &[u8] = bytemuck::cast_slice(self.section(self.head(h::W_NAME) as usize, len.div_ceil(4)));
        core::str::from_utf8(bytes.get(..len).unwrap_or(&[])).unwrap_or("")
    }

    /// SHA-256 of the source policy (policy.json, then policy.safetensors).
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = [0; 32];
        for (out, word) in digest.chunks_exact_mut(4).zip(self.section(h::W_DIGEST, 8)) {
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

    /// The least budget, in modelled instructions, with which [`crate::Head::poll`] runs the image.
    pub fn least_budget(&self) -> u32 {
        crate::slice::least_budget(self)
    }

    /// Number of operations.
    pub fn op_count(&self) -> usize {
        high(self.head(h::W_KIND))
    }

    /// The operations in order.
    pub fn ops(&self) -> impl Iterator<Item = Op<'a>> + use<'a> {
        let image = *self;
        (0..self.op_count()).filter_map(move |i| image.op(i))
    }

    /// The action contract.
    pub fn contract(&self) -> Contract<'a> {
        let mut offset = self.head(h::W_CONTRACT) as usize;
        let flags = high(self.head(h::W_WORK_FLAGS));
        let mut array = |bit: usize| {
            let len = if flags >> bit & 1 == 1 { self.act_len() } else { 0 };
            let section = self.section(offset, len);
            offset = offset.saturating_add(len);
            section
        };
        Contract { scale: array(0), offset: array(1), low: array(2), high: array(3), max_step: array(4) }
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
        let offset = self.head(h::W_SELF_TEST) as usize + step * (obs + act);
        Some((self.section(offset, obs), self.section(offset + obs, act)))
    }

    /// Operation `i`; `None` past the end. (Within a checked image every record parses.)
    pub(crate) fn op(&self, i: usize) -> Option<Op<'a>> {
        let at = self.head(h::W_OPS) as usize + i * h::OP_WORDS;
        let head = self.word(at);
        let (kind, detail, len) = (head as u8, (head >> 8) as u8, (head >> 16) as usize);
        let dst = Region { offset: self.low(at + 1), len };
        let region = |len| Region { offset: self.high(at + 1), len };
        let extra = |len| Region { offset: self.high(at + 2), len };
        let data = self.word(at + 3) as usize;
        Some(match kind {
            h::op::NORMALIZE => Op::Normalize {
                src: region(len),
                dst,
                pre_clip: self.float(data),
                clip: self.float(data + 1),
                mean: self.section(data + 2, len),
                scale: self.section(data + 2 + len, len),
            },
            h::op::LINEAR => {
                Op::Linear { src: region(self.low(at + 2)), dst, matrix: self.matrix(data)?, accumulate: detail == 1 }
            }
            h::op::FUNCTION => Op::Function { dst, function: Function::from_code(detail)? },
            h::op::LAYER_NORM => Op::LayerNorm {
                dst,
                eps: self.float(data),
                weight: self.section(data + 1, len),
                bias: self.section(data + 1 + len, len),
            },
            h::op::RMS_NORM => Op::RmsNorm { dst, eps: self.float(data), weight: self.section(data + 1, len) },
            h::op::ADD => Op::Add { src: region(len), dst },
            h::op::COPY => Op::Copy { src: region(len), dst },
            h::op::LSTM_CELL => Op::LstmCell { src: region(4 * len), dst, cell: extra(len) },
            h::op::GRU_CELL => Op::GruCell { src: region(3 * len), dst, hidden: extra(3 * len) },
            _ => return None,
        })
    }

    fn matrix(&self, at: usize) -> Option<Matrix<'a>> {
        let (rows, cols) = (self.low(at), self.high(at));
        let blocks = self.low(at + 2);
        let bias = self.word(at + 3) as usize;
        Some(Matrix {
            rows,
            cols,
            group: self.low(at + 1),
            x_max: self.high(at + 1) as u16,
            bias: if bias == 0 { &[] } else { self.section(bias, rows) },
            image: self.words,
            records: self.section(at + h::MATRIX_WORDS, blocks * h::BLOCK_WORDS),
        })
    }

    fn check(&self) -> Result<(), ImageError> {
        let reserved = self.header[28] | self.header[29] | self.header[30] | self.header[31];
        if reserved != 0 || (self.head(h::W_KIND) >> 8) as u8 != 0 || high(self.head(h::W_WORK_FLAGS)) >> 5 != 0 {
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
        let (out, action) = (self.output(), self.action());
        for region in [self.state(), self.observation(), out, action, self.work()] {
            self.in_arena(region)?;
        }
        // What survives from one step to the next must not be written by anything else.
        let (obs, work, state) = (self.observation(), self.work(), self.state());
        let pairs =
            [(out, action), (out, obs), (action, obs), (work, action), (work, state), (state, obs), (state, action)];
        if pairs.iter().any(|(a, b)| a.overlaps(*b)) {
            return Err(ImageError::Overlap);
        }
        if !(self.rate_hz().is_finite() && self.rate_hz() > 0.0) {
            return Err(ImageError::Constant);
        }
        let name_len = high(self.head(h::W_STEPS_NAME));
        let name: &[u8] = bytemuck::cast_slice(self.checked(self.head(h::W_NAME) as usize, name_len.div_ceil(4))?);
        if !is_utf8(name.get(..name_len).unwrap_or(&[])) {
            return Err(ImageError::Name);
        }
        // A head that tests nothing would report success.
        if self.self_test_steps() == 0 {
            return Err(ImageError::SelfTest);
        }
        self.constants(
            self.head(h::W_SELF_TEST) as usize,
            self.self_test_steps().saturating_mul(self.obs_len() + self.act_len()),
        )?;
        self.check_contract()?;
        self.checked(self.head(h::W_OPS) as usize, self.op_count() * h::OP_WORDS)?;
        (0..self.op_count()).try_for_each(|i| self.check_op(i))
    }

    fn check_contract(&self) -> Result<(), ImageError> {
        let arrays = (high(self.head(h::W_WORK_FLAGS)) & 0x1f).count_ones() as usize;
        self.constants(self.head(h::W_CONTRACT) as usize, arrays * self.act_len())?;
        let contract = self.contract();
        let float = |w: &u32| f32::from_bits(u32::from_le(*w));
        if contract.low.iter().zip(contract.high).any(|(low, high)| float(low) > float(high)) {
            return Err(ImageError::Limits);
        }
        if contract.max_step.iter().any(|step| float(step) < 0.0) {
            return Err(ImageError::Constant);
        }
        Ok(())
    }

    fn in_arena(&self, region: Region) -> Result<(), ImageError> {
        if region.offset + region.len <= self.scratch_words() { Ok(()) } else { Err(ImageError::Arena) }
    }

    #[inline(never)]
    fn check_op(&self, i: usize) -> Result<(), ImageError> {
        let at = self.head(h::W_OPS) as usize + i * h::OP_WORDS;
        let detail = (self.word(at) >> 8) as u8;
        let data = self.word(at + 3) as usize;
        // Shapes of the matrix are read before the op is built, so that a bad offset is named as such.
        match self.word(at) as u8 {
            h::op::LINEAR => self.checked(data, h::MATRIX_WORDS)?,
            h::op::NORMALIZE | h::op::LAYER_NORM | h::op::RMS_NORM => self.checked(data, 1)?,
            _ => &[],
        };
        let Some(op) = &self.op(i) else { return Err(ImageError::Op) };
        let uses_detail = matches!(op, Op::Function { .. } | Op::Linear { .. });
        if (!uses_detail && detail != 0) || (matches!(op, Op::Linear { .. }) && detail > 1) {
            return Err(ImageError::Reserved);
        }
        // Whether the operation has a source, a source length, a third region, constants; fields that it has not are zero.
        let has = match op {
            Op::Linear { .. } => [true, true, false, true],
            Op::Normalize { .. } => [true, false, false, true],
            Op::LayerNorm { .. } | Op::RmsNorm { .. } => [false, false, false, true],
            Op::Function { .. } => [false; 4],
            Op::Add { .. } | Op::Copy { .. } => [true, false, false, false],
            Op::LstmCell { .. } | Op::GruCell { .. } => [true, false, true, false],
        };
        let fields = [self.high(at + 1), self.low(at + 2), self.high(at + 2), data];
        if has.iter().zip(fields).any(|(has, field)| !has && field != 0) {
            return Err(ImageError::Reserved);
        }
        let clip = |x: f32| if x > 0.0 { Ok(()) } else { Err(ImageError::Constant) };
        // In-place operations have no source; the region stands in for itself.
        let (dst, sources) = match *op {
            Op::Normalize { src, dst, pre_clip, clip: limit, .. } => {
                self.checked(data, 2)?;
                clip(pre_clip)?;
                clip(limit)?;
                self.constants(data + 2, 2 * dst.len)?;
                (dst, [Some(src), None])
            }
            Op::Linear { src, dst, ref matrix, .. } => {
                self.check_matrix(data, matrix)?;
                if matrix.cols != src.len || matrix.rows != dst.len {
                    return Err(ImageError::Shape);
                }
                if self.work().len < matrix.prepared_words() {
                    return Err(ImageError::Arena);
                }
                if self.work().overlaps(src) || self.work().overlaps(dst) {
                    return Err(ImageError::Overlap);
                }
                (dst, [Some(src), None])
            }
            Op::Function { dst, .. } => (dst, [None, None]),
            Op::LayerNorm { dst, eps, .. } => {
                self.constants(data, 1 + 2 * dst.len)?;
                clip(eps)?;
                (dst, [None, None])
            }
            Op::RmsNorm { dst, eps, .. } => {
                self.constants(data, 1 + dst.len)?;
                clip(eps)?;
                (dst, [None, None])
            }
            Op::Add { src, dst } | Op::Copy { src, dst } => (dst, [Some(src), None]),
            Op::LstmCell { src, dst, cell: other } | Op::GruCell { src, dst, hidden: other } => {
                if src.overlaps(other) {
                    return Err(ImageError::Overlap);
                }
                (dst, [Some(src), Some(other)])
            }
        };
        if dst.len == 0 {
            return Err(ImageError::Shape);
        }
        self.in_arena(dst)?;
        // The last action carries the step limit; only the contract writes it.
        let cell_over_action = matches!(op, Op::LstmCell { cell, .. } if cell.overlaps(self.action()));
        if dst.overlaps(self.action()) || cell_over_action {
            return Err(ImageError::Overlap);
        }
        for src in sources.into_iter().flatten() {
            self.in_arena(src)?;
            if src.overlaps(dst) {
                return Err(ImageError::Overlap);
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn check_matrix(&self, at: usize, matrix: &Matrix<'a>) -> Result<(), ImageError> {
        let blocks = self.low(at + 2);
        if self.high(at + 2) != 0 {
            return Err(ImageError::Reserved);
        }
        self.checked(at + h::MATRIX_WORDS, blocks * h::BLOCK_WORDS)?;
        if matrix.rows == 0 || matrix.rows > h::MAX_ROWS || matrix.cols == 0 {
            return Err(ImageError::Shape);
        }
        if !matches!(matrix.group, 0 | 32 | 64 | 128) {
            return Err(ImageError::Group);
        }
        if matrix.x_max == 0 || matrix.x_max > i16::MAX as u16 {
            return Err(ImageError::Constant);
        }
        let bias = self.word(at + 3) as usize;
        if bias != 0 {
            self.constants(bias, matrix.rows)?;
        }
        let mut seen = [0u32; h::MAX_ROWS / 32];
        let mut first_row = 0;
        for i in 0..blocks {
            let record = at + h::MATRIX_WORDS + i * h::BLOCK_WORDS;
            self.check_block(matrix, record)?;
            let record = self.section(record, h::BLOCK_WORDS);
            let Some(rows) = row_block(matrix, record, first_row) else { return Err(ImageError::Section) };
            first_row += rows.block.shape().rows;
            for row in 0..rows.block.shape().rows {
                let output = rows.output(row);
                let word = seen.get_mut(output / 32).ok_or(ImageError::Index)?;
                if output >= matrix.rows || *word >> (output % 32) & 1 == 1 {
                    return Err(ImageError::Index);
                }
                *word |= 1 << (output % 32);
                let scale = rows.scale(row);
                if !(scale.is_finite() && scale.is_sign_positive()) {
                    return Err(ImageError::Constant);
                }
            }
            if worst_case_bound(&rows.block, matrix.x_max) > i64::from(i32::MAX)
                && worst_case(&rows.block, matrix.x_max) > i64::from(i32::MAX)
            {
                return Err(ImageError::Overflow);
            }
        }
        Ok(())
    }

    #[inline(never)]
    fn check_block(&self, matrix: &Matrix<'a>, at: usize) -> Result<(), ImageError> {
        let head = self.word(at);
        let width = Width::from_bits(head & 0xff).ok_or(ImageError::Width)?;
        let lanes = Lanes::from_code((head >> 8) as u8).ok_or(ImageError::Lanes)?;
        if lanes != matrix.lanes() {
            return Err(ImageError::Lanes);
        }
        let rows = (head >> 16) as usize;
        let shape = BlockShape { width, lanes, rows, cols: matrix.cols, group: matrix.group };
        if !shape.is_valid() || rows > matrix.rows {
            return Err(ImageError::Shape);
        }
        self.checked(self.word(at + 1) as usize, shape.words())?;
        self.checked(self.word(at + 2) as usize, rows.div_ceil(2))?;
        if self.word(at + 3) != 0 {
            self.checked(self.word(at + 3) as usize, rows.div_ceil(2))?;
        }
        Ok(())
    }
}

/// What `core::str::from_utf8` finds, in a quarter of its code.
fn is_utf8(bytes: &[u8]) -> bool {
    // Bytes that must follow, the code point so far, and the least one that needs so many bytes.
    let (mut more, mut point, mut least) = (0, 0, 0);
    for &byte in bytes {
        let byte = u32::from(byte);
        if more > 0 {
            if byte & 0xc0 != 0x80 {
                return false;
            }
            (more, point) = (more - 1, point << 6 | byte & 0x3f);
            if more == 0 && (point < least || point > 0x10_ffff || (0xd800..0xe000).contains(&point)) {
                return false;
            }
        } else {
            (more, point, least) = match byte {
                0..0x80 => (0, 0, 0),
                0xc0..0xe0 => (1, byte & 0x1f, 0x80),
                0xe0..0xf0 => (2, byte & 0x0f, 0x800),
                0xf0..0xf8 => (3, byte & 0x07, 0x1_0000),
                _ => return false,
            };
        }
    }
    more == 0
}

/// The block of a record; `None` where its words do not fit its shape.
#[inline(never)]
pub(crate) fn row_block<'a>(matrix: &Matrix<'a>, record: &'a [u32], first_row: usize) -> Option<RowBlock<'a>> {
    let word = |i: usize| record.get(i).map_or(0, |w| u32::from_le(*w));
    let rows = (word(0) >> 16) as usize;
    let width = Width::from_bits(word(0) & 0xff)?;
    let lanes = Lanes::from_code((word(0) >> 8) as u8)?;
    let shape = BlockShape { width, lanes, rows, cols: matrix.cols, group: matrix.group };
    let section = |offset: u32, len: usize| {
        let offset = offset as usize;
        offset.checked_add(len).and_then(|end| matrix.image.get(offset..end))
    };
    Some(RowBlock {
        block: Block::new(shape, section(word(1), shape.words())?)?,
        scales: section(word(2), rows.div_ceil(2))?,
        index: if word(3) == 0 { &[] } else { section(word(3), rows.div_ceil(2))? },
        first_row,
    })
}

impl<'a> Matrix<'a> {
    /// The blocks in the order of the image.
    pub fn blocks(&self) -> impl Iterator<Item = RowBlock<'a>> + use<'a> {
        let matrix = *self;
        let mut first_row = 0;
        self.records.chunks_exact(h::BLOCK_WORDS).filter_map(move |record| {
            let rows = row_block(&matrix, record, first_row)?;
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
    use super::is_utf8;

    /// All sequences of up to four bytes from those where the rules change.
    #[test]
    fn utf8_is_what_core_says() {
        let edges =
            [0x00, 0x7f, 0x80, 0x8f, 0x90, 0x9f, 0xa0, 0xbf, 0xc0, 0xc1, 0xc2, 0xdf, 0xe0, 0xe1, 0xec, 0xed, 0xee];
        let edges = [&edges[..], &[0xef, 0xf0, 0xf1, 0xf3, 0xf4, 0xf5, 0xf7, 0xf8, 0xff]].concat();
        let mut sequences = vec![Vec::new()];
        for _ in 0..4 {
            let longer = sequences.iter().flat_map(|s: &Vec<u8>| edges.iter().map(|b| [&s[..], &[*b]].concat()));
            sequences = longer.collect();
            for bytes in &sequences {
                assert_eq!(is_utf8(bytes), core::str::from_utf8(bytes).is_ok(), "{bytes:x?}");
            }
        }
    }
}
