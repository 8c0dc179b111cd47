//! A parsed image, and what its header says.

use super::header::{self as h, Kind};
use super::region::Region;
use super::words::{high, low, section, word};

/// A checked image.
#[derive(Clone, Copy, Debug)]
pub struct Image<'a> {
    pub(super) words: &'a [u32],
    /// The first of them.
    pub(super) header: &'a [u32; h::WORDS],
}

impl<'a> Image<'a> {
    /// `ACTQ`, the first word of every image.
    pub const MAGIC: u32 = h::MAGIC;
    /// Index of the header's word that holds the image's length in bytes: to find the end of an image in a flash slot.
    pub const LENGTH_WORD: usize = h::W_BYTES;

    /// An image whose memory may hold anything, as it does where flash has changed since the check: to test what
    /// becomes of it. A step of it ends with an action that means nothing or with [`crate::StepError::Damaged`]. `None`
    /// where the bytes are misaligned, no whole words, or shorter than a header.
    #[cfg(feature = "writer")]
    #[doc(hidden)]
    pub fn unchecked(bytes: &'a [u8]) -> Option<Self> {
        let words: &[u32] = bytemuck::try_cast_slice(bytes).ok()?;
        Some(Self { words, header: words.first_chunk()? })
    }

    pub(super) fn word(&self, i: usize) -> u32 {
        word(self.words, i)
    }

    /// A word of the header.
    #[inline(always)]
    pub(super) fn head(&self, i: usize) -> u32 {
        u32::from_le(self.header[i])
    }

    /// As [`section`]; empty where that refuses.
    pub(super) fn section(&self, offset: usize, len: usize) -> &'a [u32] {
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
        Kind::ALL.get(usize::from(self.head(h::W_KIND) as u8)).copied().unwrap_or(Kind::Step)
    }

    /// Actions in the network's output.
    pub fn chunk(&self) -> usize {
        low(self.head(h::W_CHUNK))
    }

    /// How many of a chunk's actions are executed before the network runs again.
    pub fn execute(&self) -> usize {
        high(self.head(h::W_CHUNK))
    }

    writer_methods! {
        /// The first of the operations that every denoising step runs; 0 where the network runs once.
        fn once(&self) -> usize {
            low(self.head(h::W_DENOISING))
        }
    }

    /// How often these run: the denoising steps, or 1.
    pub fn denoising_steps(&self) -> usize {
        high(self.head(h::W_DENOISING)).max(1)
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
    pub(super) fn name_len(&self) -> usize {
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

    writer_methods! {
        /// Arena region that a reset zeroes.
        fn state(&self) -> Region {
            Region { offset: low(self.head(h::W_STATE)), len: high(self.head(h::W_STATE)) }
        }

        /// Arena region of the observation.
        fn observation(&self) -> Region {
            Region { offset: low(self.head(h::W_OBS_OUT)), len: self.obs_len() }
        }

        /// Arena region of the network's output.
        fn output(&self) -> Region {
            Region { offset: high(self.head(h::W_OBS_OUT)), len: self.chunk() * self.act_len() }
        }

        /// Arena region of the action.
        fn action(&self) -> Region {
            Region { offset: low(self.head(h::W_ACTION_WORK)), len: self.act_len() }
        }

        /// Arena region in which activations are prepared.
        fn work(&self) -> Region {
            Region { offset: high(self.head(h::W_ACTION_WORK)), len: low(self.head(h::W_WORK_FLAGS)) }
        }
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
}
