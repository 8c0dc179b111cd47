//! A checked image and its header fields.

use core::fmt;

use super::header::{self as h, Kind, Words};
use super::region::Region;
use super::words::{section, word};

/// A checked image.
#[derive(Clone, Copy)]
pub struct Image<'a> {
    pub(super) words: &'a [u32],
    pub(super) header: Words<'a>,
}

/// Not its content, which a log must not be filled with.
impl fmt::Debug for Image<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Image").field("name", &self.name()).field("bytes", &self.bytes()).finish_non_exhaustive()
    }
}

impl<'a> Image<'a> {
    /// The first word of every image: `ACTQ`.
    pub const MAGIC: u32 = h::MAGIC;
    /// Index of the header word with the image's length in bytes: to find the end of an image in a flash slot.
    pub const LENGTH_WORD: usize = h::W_BYTES;

    /// Reads an image without its check, for tests of flash that changes after the check. Its steps end with a
    /// meaningless action or with [`crate::StepError::Damaged`]. Returns `None` if the bytes are misaligned, not whole
    /// words, or shorter than a header.
    #[cfg(feature = "writer")]
    #[doc(hidden)]
    pub fn unchecked(bytes: &'a [u8]) -> Option<Self> {
        let words: &[u32] = bytemuck::try_cast_slice(bytes).ok()?;
        Some(Self { words, header: Words(words.first_chunk()?) })
    }

    /// Returns word `i`; 0 after the end.
    pub(super) fn word(&self, i: usize) -> u32 {
        word(self.words, i)
    }

    /// Returns a [`section`]; empty if the image does not have it.
    pub(super) fn section(&self, offset: usize, len: usize) -> &'a [u32] {
        section(self.words, offset, len).unwrap_or_default()
    }

    /// Returns the number of values of an observation.
    pub fn obs_len(&self) -> usize {
        self.header.obs_len()
    }

    /// Returns the number of values of an action.
    pub fn act_len(&self) -> usize {
        self.header.act_len()
    }

    /// Returns the meaning of the output.
    pub fn kind(&self) -> Kind {
        Kind::ALL.get(self.header.kind() & 0xff).copied().unwrap_or(Kind::Step)
    }

    /// Returns the number of actions in the network's output.
    pub fn chunk(&self) -> usize {
        if cfg!(feature = "chunks") { self.header.chunk() } else { 1 }
    }

    /// Returns the number of a chunk's actions that are executed before the network runs again.
    pub fn execute(&self) -> usize {
        if cfg!(feature = "chunks") { self.header.execute() } else { 1 }
    }

    writer_methods! {
        /// Returns the first operation that every denoising step runs; 0 without denoising steps.
        fn first_denoising_op(&self) -> usize {
            self.header.first_denoising_op()
        }
    }

    /// Returns the number of denoising steps; 1 if an evaluation runs the network once.
    pub fn denoising_steps(&self) -> usize {
        self.header.denoising_steps().max(1)
    }

    /// Returns the words of scratch memory that a head needs.
    pub fn scratch_words(&self) -> usize {
        self.header.scratch()
    }

    /// Returns the control rate that the policy was trained for, in Hz.
    pub fn rate_hz(&self) -> f32 {
        f32::from_bits(self.header.rate() as u32)
    }

    /// Returns the policy's name.
    pub fn name(&self) -> &'a str {
        let words = self.section(self.header.name(), self.name_len().div_ceil(4));
        let bytes = bytemuck::must_cast_slice(words).get(..self.name_len()).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Returns the bytes of the name.
    pub(super) fn name_len(&self) -> usize {
        self.header.name_len()
    }

    /// Returns the SHA-256 of the source policy (policy.json, then policy.safetensors).
    pub fn digest(&self) -> [u8; 32] {
        self.header.digest()
    }

    /// Returns the number of weights of the original network's matrices, before any rows were removed.
    pub fn source_weights(&self) -> usize {
        self.header.weights()
    }

    /// Returns the CRC-32 of the image, as in the header.
    pub fn crc(&self) -> u32 {
        self.header.crc() as u32
    }

    /// Returns the length of the image, in bytes.
    pub fn bytes(&self) -> usize {
        self.words.len() * 4
    }

    writer_methods! {
        /// Returns the arena region of the recurrent state, which a reset zeroes.
        fn state(&self) -> Region {
            Region { offset: self.header.state(), len: self.header.state_len() }
        }

        /// Returns the arena region of the observation.
        fn observation(&self) -> Region {
            Region { offset: self.header.observation(), len: self.obs_len() }
        }

        /// Returns the arena region of the network's output.
        fn output(&self) -> Region {
            Region { offset: self.header.output(), len: self.chunk() * self.act_len() }
        }

        /// Returns the arena region of the action.
        fn action(&self) -> Region {
            Region { offset: self.header.action(), len: self.act_len() }
        }

        /// Returns the arena region in which activations are prepared.
        fn work(&self) -> Region {
            Region { offset: self.header.work(), len: self.header.work_len() }
        }
    }

    /// Returns the number of self-test steps.
    pub fn self_test_steps(&self) -> usize {
        self.header.self_test_steps()
    }

    /// Returns the observation and the expected action of a self-test step, as f32 bits in little-endian words. The
    /// steps play in order after a reset.
    pub fn self_test(&self, step: usize) -> Option<(&'a [u32], &'a [u32])> {
        if step >= self.self_test_steps() {
            return None;
        }
        let (obs, act) = (self.obs_len(), self.act_len());
        let offset = self.header.self_test().wrapping_add(step.wrapping_mul(obs + act));
        self.section(offset, obs + act).split_at_checked(obs)
    }
}
