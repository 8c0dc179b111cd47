//! Reads an image back from flash in pieces, to verify its checksum and signature.

use actq_link::frame::CRC;
use crc::Digest;
use embedded_storage::nor_flash::NorFlash;

use super::authority::Authority;
use crate::update::Plan;

/// Bytes of a piece.
const BLOCK: usize = 256;

/// State of reading an image back.
pub(super) struct Readback<H> {
    at: u32,
    crc: Digest<'static, u32>,
    hash: H,
}

/// Outcome of reading an image back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// The image may run.
    Good,
    /// The image differs from the announced one, or cannot be read.
    Damaged,
    /// The signature is missing or invalid.
    Unsigned,
}

impl<H> Readback<H> {
    pub(super) fn new<A: Authority<Hash = H>>(authority: &A) -> Self {
        Self { at: 0, crc: CRC.digest(), hash: authority.hash() }
    }

    /// Returns `true` if the next block is the last one, after which the signature is checked.
    pub(super) const fn is_last(&self, plan: &Plan) -> bool {
        plan.length.saturating_sub(self.at) <= BLOCK as u32
    }

    /// Reads the next block of the image at the address `image`. Returns itself until the image ends.
    pub(super) fn advance<F: NorFlash, A: Authority<Hash = H>>(
        mut self,
        flash: &mut F,
        image: u32,
        plan: &Plan,
        signature: Option<&[u8; 64]>,
        authority: &A,
    ) -> Result<Self, Found> {
        let mut buffer = [0; BLOCK];
        let left = usize::try_from(plan.length.saturating_sub(self.at)).unwrap_or(usize::MAX);
        let block = buffer.get_mut(..left.min(BLOCK)).unwrap_or_default();
        flash.read(image.wrapping_add(self.at), block).map_err(|_| Found::Damaged)?;
        self.crc.update(block);
        A::add(&mut self.hash, block);
        self.at = self.at.saturating_add(BLOCK as u32);
        if self.at < plan.length {
            return Ok(self);
        }
        if self.crc.finalize() != plan.crc {
            return Err(Found::Damaged);
        }
        Err(if authority.accepts(self.hash, plan.version, signature) { Found::Good } else { Found::Unsigned })
    }
}
