//! The interface of an image update over the link.

use actq_link::code::Refusal;

#[cfg(feature = "prefix")]
use crate::prefix::Transfer;

/// Announcement of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Length in bytes; whole words.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of all bytes.
    pub crc: u32,
    /// Version. It must not be lower than a confirmed version.
    pub version: u32,
}

/// Carries out the requests of an update. A host repeats a request whose acknowledgement was lost. A request that takes
/// longer than a call may returns [`Refusal::Busy`] until it is done.
pub trait Update {
    /// Erases a slot for an image.
    ///
    /// # Errors
    ///
    /// Returns the reason for a refusal.
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal>;

    /// Writes the image's next bytes.
    ///
    /// # Errors
    ///
    /// Returns the reason for not writing them.
    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal>;

    /// Checks the image and makes it the running one.
    ///
    /// # Errors
    ///
    /// Returns the reason for not running it.
    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal>;

    /// Cancels the update.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Busy`] while an image waits for its test, which it may pass.
    fn abort(&mut self) -> Result<(), Refusal>;

    /// Returns the number of accepted bytes of the image.
    fn written(&self) -> u32;

    /// Returns `true` while a slot is being erased, or an image checked or tested.
    fn is_busy(&self) -> bool;

    /// Calls `run` with the transfer of the running image's prefix; `None` without an image.
    #[cfg(feature = "prefix")]
    fn with_prefix<T>(&mut self, _run: impl FnOnce(&mut Transfer<'_>) -> T) -> Option<T> {
        None
    }
}

/// A controller whose image is built in.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoUpdate;

impl Update for NoUpdate {
    fn begin(&mut self, _: Plan) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn chunk(&mut self, _: u32, _: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn commit(&mut self, _: Option<&[u8; 64]>) -> Result<(), Refusal> {
        Err(Refusal::Unsupported)
    }

    fn abort(&mut self) -> Result<(), Refusal> {
        Ok(())
    }

    fn written(&self) -> u32 {
        0
    }

    fn is_busy(&self) -> bool {
        false
    }
}
