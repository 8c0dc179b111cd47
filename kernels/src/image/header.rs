//! The header: one table of its fields, by which they are read and written.

use super::region::Region;
use super::words::{HEADER_WORDS, Part};
use super::words::{Records, TooLarge};
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
/// Index of the factor of a denoising step's own noise among its coefficients.
pub const SIGMA: usize = 5;
/// Most rows of a matrix.
pub const MAX_ROWS: usize = 4096;
/// Most words of an arena: offsets in it are u16.
pub const MAX_SCRATCH: usize = 0xffff;

/// Declares the header's words in one table. Each field has a place for both sides: [`Words`] reads it by its name,
/// and [`Header::emit`] writes the value that follows it there.
macro_rules! header {
    (|$header:ident| $($(#[$doc:meta])* $WORD:ident = $index:literal: $($field:ident $part:ident = $value:expr),+;)*) => {
        $($(#[$doc])* pub const $WORD: usize = $index;)*

        impl Words<'_> {
            $($(
                #[inline(always)]
                pub(super) const fn $field(self) -> usize {
                    Part::$part.of(u32::from_le(self.0[$WORD]))
                }
            )+)*
        }

        impl Header {
            /// Returns the header's words, without length and checksum ([`seal`](super::crc::seal)).
            ///
            /// # Errors
            ///
            /// [`TooLarge`] if a size does not fit its field.
            pub fn emit(&self) -> Result<[u32; WORDS], TooLarge> {
                let ($header, mut words) = (self, [0; WORDS]);
                $($(words[$WORD] |= Part::$part.put($value)?;)+)*
                for (word, bytes) in words.iter_mut().skip(W_DIGEST).zip(self.digest.as_chunks().0) {
                    *word = u32::from_le_bytes(*bytes);
                }
                Ok(words)
            }
        }
    };
}
header! { |header|
    /// `ACTQ` in the first four bytes.
    W_MAGIC = 0: magic Whole = MAGIC as usize;
    /// u16 version, u16 header words.
    W_VERSION = 1: version Low = VERSION.into(), header_words High = WORDS;
    /// Length of the image in bytes.
    W_BYTES = 2: bytes Whole = 0;
    /// CRC-32 (ISO-HDLC, as in zlib) of all bytes from word 4 on.
    W_CRC = 3: crc Whole = 0;
    /// Kernel layout stamp.
    W_LAYOUT = 4: layout Whole = LAYOUT_STAMP as usize;
    /// u8 kind, u8 1 if ports follow the self-test, else 0, u16 number of operations.
    W_KIND = 5: kind Low = header.kind as usize | usize::from(header.has_ports) << 8, op_count High = header.ops.count;
    /// Offset of the operation records.
    W_OPS = 6: ops Whole = header.ops.offset as usize;
    /// u16 observation length, u16 action length.
    W_SIZES = 7: obs_len Low = header.obs_len, act_len High = header.act_len;
    /// u16 actions in a chunk, u16 of them executed.
    W_CHUNK = 8: chunk Low = header.chunk, execute High = header.execute;
    /// Arena length in words, which fits a u16.
    W_SCRATCH = 9: scratch Whole = Part::Low.put(header.scratch)? as usize;
    /// u16 arena offset and u16 length of the state that a reset zeroes.
    W_STATE = 10: state Low = header.state.offset, state_len High = header.state.len;
    /// u16 arena offset of the observation, u16 of the network's output.
    W_OBS_OUT = 11: observation Low = header.observation, output High = header.output;
    /// u16 arena offset of the action, u16 of the work area.
    W_ACTION_WORK = 12: action Low = header.action, work High = header.work.offset;
    /// u16 length of the work area, u16 flags of the action contract.
    W_WORK_FLAGS = 13: work_len Low = header.work.len, contract_flags High = header.contract_flags;
    /// Offset of the action contract's arrays.
    W_CONTRACT = 14: contract Whole = header.contract as usize;
    /// f32 control rate in Hz.
    W_RATE = 15: rate Whole = header.rate_hz.to_bits() as usize;
    /// Offset of the self-test vector.
    W_SELF_TEST = 16: self_test Whole = header.self_test.offset as usize;
    /// u16 steps of the self-test, u16 bytes of the name.
    W_STEPS_NAME = 17: self_test_steps Low = header.self_test.count, name_len High = header.name.count;
    /// Offset of the policy's name.
    W_NAME = 18: name Whole = header.name.offset as usize;
    /// Weights of the source policy's matrices.
    W_WEIGHTS = 19: weights Whole = header.weights as usize;
    /// Offset of the matrix records.
    W_MATRICES = 28: matrices Whole = header.matrices.offset as usize;
    /// u16 number of matrices, u16 chunks that a temporal ensemble averages for an action, or 0.
    W_MATRIX_COUNT = 29: matrix_count Low = header.matrices.count, horizon High = header.horizon;
    /// u16 first operation that every denoising step runs, u16 denoising steps; both 0 if an evaluation runs the
    /// network once.
    W_DENOISING = 30: first_denoising_op Low = header.first_denoising_op, denoising_steps High = header.denoising_steps;
    /// u16 actions that blend one chunk into the next, u16 age from which on an action never plays; 0 for none.
    W_PLAYBACK = 31: overlap Low = header.overlap, deadline High = header.deadline;
}
/// SHA-256 of the source policy, 8 words.
pub const W_DIGEST: usize = 20;

/// The words of a header as in memory; each method reads a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words<'a>(pub(super) &'a [u32; WORDS]);

impl Words<'_> {
    pub(super) fn digest(self) -> [u8; 32] {
        let mut digest = [0; 32];
        for (out, word) in digest.chunks_exact_mut(4).zip(self.0.iter().skip(W_DIGEST)) {
            out.copy_from_slice(&word.to_ne_bytes());
        }
        digest
    }
}

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
    pub const ALL: &[Self] = &[Self::Step, Self::Chunk, Self::Flow, Self::Diffusion];

    /// Returns `true` if an evaluation runs the network in several denoising steps.
    pub const fn is_iterative(self) -> bool {
        matches!(self, Self::Flow | Self::Diffusion)
    }
}

/// The fields of a header, for a writer.
#[derive(Clone, Copy, Debug)]
pub struct Header {
    /// The meaning of the output.
    pub kind: Kind,
    /// Ports follow the self-test.
    pub has_ports: bool,
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
    /// Denoising steps; 0 if an evaluation runs the network once.
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
