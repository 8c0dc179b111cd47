//! A checked image and its header fields.

use super::header::{self as h, Kind};
use super::region::Region;
use super::words::{high, low, section, word};

/// A checked image.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    pub(super) words: &'a [u32],
    /// The first words, the header.
    pub(super) header: &'a [u32; h::WORDS],
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
        Some(Self { words, header: words.first_chunk()? })
    }

    /// Returns word `i`; 0 after the end.
    pub(super) fn word(&self, i: usize) -> u32 {
        word(self.words, i)
    }

    /// Returns a word of the header.
    #[inline(always)]
    pub(super) fn head(&self, i: usize) -> u32 {
        u32::from_le(self.header[i])
    }

    /// Returns a [`section`]; empty if the image does not have it.
    pub(super) fn section(&self, offset: usize, len: usize) -> &'a [u32] {
        section(self.words, offset, len).unwrap_or_default()
    }

    /// Returns the number of values of an observation.
    pub fn obs_len(&self) -> usize {
        low(self.head(h::W_SIZES))
    }

    /// Returns the number of values of an action.
    pub fn act_len(&self) -> usize {
        high(self.head(h::W_SIZES))
    }

    /// Returns the meaning of the output.
    pub fn kind(&self) -> Kind {
        Kind::ALL.get(usize::from(self.head(h::W_KIND) as u8)).copied().unwrap_or(Kind::Step)
    }

    /// Returns the number of actions in the network's output.
    pub fn chunk(&self) -> usize {
        low(self.head(h::W_CHUNK))
    }

    /// Returns the number of a chunk's actions that are executed before the network runs again.
    pub fn execute(&self) -> usize {
        high(self.head(h::W_CHUNK))
    }

    writer_methods! {
        /// Returns the first operation that every denoising step runs; 0 without denoising steps.
        fn first_denoising_op(&self) -> usize {
            low(self.head(h::W_DENOISING))
        }
    }

    /// Returns the number of denoising steps; 1 if an evaluation runs the network one time.
    pub fn denoising_steps(&self) -> usize {
        high(self.head(h::W_DENOISING)).max(1)
    }

    /// Returns the words of scratch memory that a head needs.
    pub fn scratch_words(&self) -> usize {
        self.head(h::W_SCRATCH) as usize
    }

    /// Returns the control rate that the policy was trained for, in Hz.
    pub fn rate_hz(&self) -> f32 {
        f32::from_bits(self.head(h::W_RATE))
    }

    /// Returns the policy's name.
    pub fn name(&self) -> &'a str {
        let words = self.section(self.head(h::W_NAME) as usize, self.name_len().div_ceil(4));
        let bytes = bytemuck::must_cast_slice(words).get(..self.name_len()).unwrap_or_default();
        core::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Returns the bytes of the name.
    pub(super) fn name_len(&self) -> usize {
        high(self.head(h::W_STEPS_NAME))
    }

    /// Returns the SHA-256 of the source policy (policy.json, then policy.safetensors).
    pub fn digest(&self) -> [u8; 32] {
        let mut digest = [0; 32];
        for (out, word) in digest.chunks_exact_mut(4).zip(self.header.iter().skip(h::W_DIGEST)) {
            out.copy_from_slice(&word.to_ne_bytes());
        }
        digest
    }

    /// Returns the number of weights of the original network's matrices, before any rows were removed.
    pub fn source_weights(&self) -> usize {
        self.head(h::W_WEIGHTS) as usize
    }

    /// Returns the CRC-32 of the image, as in the header.
    pub fn crc(&self) -> u32 {
        self.head(h::W_CRC)
    }

    /// Returns the length of the image, in bytes.
    pub fn bytes(&self) -> usize {
        self.words.len() * 4
    }

    writer_methods! {
        /// Returns the arena region of the recurrent state, which a reset zeroes.
        fn state(&self) -> Region {
            Region { offset: low(self.head(h::W_STATE)), len: high(self.head(h::W_STATE)) }
        }

        /// Returns the arena region of the observation.
        fn observation(&self) -> Region {
            Region { offset: low(self.head(h::W_OBS_OUT)), len: self.obs_len() }
        }

        /// Returns the arena region of the network's output.
        fn output(&self) -> Region {
            Region { offset: high(self.head(h::W_OBS_OUT)), len: self.chunk() * self.act_len() }
        }

        /// Returns the arena region of the action.
        fn action(&self) -> Region {
            Region { offset: low(self.head(h::W_ACTION_WORK)), len: self.act_len() }
        }

        /// Returns the arena region in which activations are prepared.
        fn work(&self) -> Region {
            Region { offset: high(self.head(h::W_ACTION_WORK)), len: low(self.head(h::W_WORK_FLAGS)) }
        }
    }

    /// Returns the number of self-test steps.
    pub fn self_test_steps(&self) -> usize {
        low(self.head(h::W_STEPS_NAME))
    }

    /// Returns the observation and the expected action of a self-test step, as f32 bits in little-endian words. The
    /// steps play in order after a reset.
    pub fn self_test(&self, step: usize) -> Option<(&'a [u32], &'a [u32])> {
        if step >= self.self_test_steps() {
            return None;
        }
        let (obs, act) = (self.obs_len(), self.act_len());
        let offset = (self.head(h::W_SELF_TEST) as usize).wrapping_add(step * (obs + act));
        self.section(offset, obs + act).split_at_checked(obs)
    }
}
