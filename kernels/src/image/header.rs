//! The header: the places of its fields, and how they are written. [`Image`](super::Image) reads them.

#[cfg(feature = "writer")]
use super::region::Region;
use super::words::HEADER_WORDS;
#[cfg(feature = "writer")]
use super::words::{Records, TooLarge, halves};
#[cfg(feature = "writer")]
use crate::layout::LAYOUT_STAMP;

/// `ACTQ` in the first four bytes.
pub const MAGIC: u32 = u32::from_le_bytes(*b"ACTQ");
/// Format version.
pub const VERSION: u16 = 3;
/// Words of the header.
pub const WORDS: usize = HEADER_WORDS;
/// Words before the checksummed part: magic, version, length, checksum.
pub const UNCHECKED_WORDS: usize = 4;
/// Words of an operation record.
pub const OP_WORDS: usize = 4;
/// Words of a matrix record.
pub const MATRIX_WORDS: usize = 4;
/// Words of a block record.
pub const BLOCK_WORDS: usize = 4;
/// Words of the constants of a denoise operation before the coefficients of its steps.
pub const DENOISE_WORDS: usize = 2;
/// Coefficients of a denoising step.
pub const COEFFICIENTS: usize = 7;
/// Most rows of a matrix.
pub const MAX_ROWS: usize = 4096;
/// Most words of an arena: offsets in it are u16.
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
/// u16 actions in a chunk, u16 of them executed.
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
/// u16 number of matrices, u16 chunks that a temporal ensemble averages for an action, or 0.
pub const W_MATRIX_COUNT: usize = 29;
/// u16 first operation that every denoising step runs, u16 denoising steps; both 0 if an evaluation runs the network
/// one time.
pub const W_DENOISING: usize = 30;
/// u16 actions that blend one chunk into the next, u16 age from which on an action never plays; 0 for none.
pub const W_PLAYBACK: usize = 31;

/// The meaning of a policy's output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// One action per evaluation.
    Step = 0,
    /// An action chunk per evaluation, of which the first actions are executed.
    Chunk = 1,
    /// A chunk that a flow makes from noise.
    Flow = 2,
    /// A chunk that reverse diffusion makes from noise.
    Diffusion = 3,
}

impl Kind {
    /// All kinds, by number.
    pub const ALL: [Self; 4] = [Self::Step, Self::Chunk, Self::Flow, Self::Diffusion];

    /// Returns `true` if an evaluation runs the network in several denoising steps.
    pub const fn is_iterative(self) -> bool {
        matches!(self, Self::Flow | Self::Diffusion)
    }
}

/// The fields of a header, for a writer.
#[cfg(feature = "writer")]
#[derive(Clone, Copy, Debug)]
pub struct Header {
    /// The meaning of the output.
    pub kind: Kind,
    /// Length of an observation.
    pub obs_len: usize,
    /// Length of an action.
    pub act_len: usize,
    /// Actions in the network's output.
    pub chunk: usize,
    /// Executed actions of a chunk.
    pub execute: usize,
    /// Chunks that a temporal ensemble averages for an action, or 0.
    pub horizon: usize,
    /// Actions that blend one chunk into the next.
    pub overlap: usize,
    /// Age from which on an action never plays, in control periods, or 0.
    pub deadline: usize,
    /// Control rate in Hz.
    pub rate_hz: f32,
    /// Words of the arena.
    pub scratch: usize,
    /// Arena region that a reset zeroes.
    pub state: Region,
    /// Arena offset of the observation.
    pub observation: usize,
    /// Arena offset of the network's output.
    pub output: usize,
    /// Arena offset of the action.
    pub action: usize,
    /// Arena region in which activations are prepared.
    pub work: Region,
    /// The matrix records.
    pub matrices: Records,
    /// The operation records.
    pub ops: Records,
    /// First operation that every denoising step runs; 0 without denoising steps.
    pub first_denoising_op: usize,
    /// Denoising steps; 0 if an evaluation runs the network one time.
    pub denoising_steps: usize,
    /// Offset of the action contract's arrays.
    pub contract: u32,
    /// The arrays that the contract has: array `i` by bit `i`.
    pub contract_flags: usize,
    /// The policy's name, in bytes.
    pub name: Records,
    /// The self-test vector, in steps.
    pub self_test: Records,
    /// Weights of the source policy's matrices.
    pub weights: u32,
    /// SHA-256 of the source policy.
    pub digest: [u8; 32],
}

#[cfg(feature = "writer")]
impl Header {
    /// Returns the header's words, without length and checksum ([`seal`](super::crc::seal)).
    ///
    /// # Errors
    ///
    /// [`TooLarge`] if a size does not fit its field.
    pub fn emit(&self) -> Result<[u32; WORDS], TooLarge> {
        let mut words = [0; WORDS];
        words[0] = MAGIC;
        words[W_VERSION] = halves(VERSION.into(), WORDS)?;
        words[W_LAYOUT] = LAYOUT_STAMP;
        words[W_KIND] = halves(self.kind as usize, self.ops.count)?;
        words[W_OPS] = self.ops.offset;
        words[W_SIZES] = halves(self.obs_len, self.act_len)?;
        words[W_CHUNK] = halves(self.chunk, self.execute)?;
        words[W_SCRATCH] = halves(self.scratch, 0)?;
        words[W_STATE] = halves(self.state.offset, self.state.len)?;
        words[W_OBS_OUT] = halves(self.observation, self.output)?;
        words[W_ACTION_WORK] = halves(self.action, self.work.offset)?;
        words[W_WORK_FLAGS] = halves(self.work.len, self.contract_flags)?;
        words[W_CONTRACT] = self.contract;
        words[W_RATE] = self.rate_hz.to_bits();
        words[W_SELF_TEST] = self.self_test.offset;
        words[W_STEPS_NAME] = halves(self.self_test.count, self.name.count)?;
        words[W_NAME] = self.name.offset;
        words[W_WEIGHTS] = self.weights;
        for (word, bytes) in words.iter_mut().skip(W_DIGEST).zip(self.digest.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        words[W_MATRICES] = self.matrices.offset;
        words[W_MATRIX_COUNT] = halves(self.matrices.count, self.horizon)?;
        words[W_DENOISING] = halves(self.first_denoising_op, self.denoising_steps)?;
        words[W_PLAYBACK] = halves(self.overlap, self.deadline)?;
        Ok(words)
    }
}
