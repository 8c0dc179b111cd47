//! What an image update over the link asks of whoever does it.

use actq_link::code::Refusal;

/// What is announced of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Bytes; whole words.
    pub length: u32,
    /// CRC-32 (ISO-HDLC) of all of them.
    pub crc: u32,
    /// Version, which must not be lower than one that was confirmed.
    pub version: u32,
}

/// Does the requests of an update. Each may come again where its acknowledgement was lost. Where one takes longer than
/// a call may, it is [`Refusal::Busy`] until it is done.
pub trait Update {
    /// Makes room for an image.
    ///
    /// # Errors
    ///
    /// Why there is none.
    fn begin(&mut self, plan: Plan) -> Result<(), Refusal>;

    /// Writes the image's next bytes.
    ///
    /// # Errors
    ///
    /// Why they are not written.
    fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal>;

    /// Checks the image and makes it the one that runs.
    ///
    /// # Errors
    ///
    /// Why it does not run.
    fn commit(&mut self, signature: Option<&[u8; 64]>) -> Result<(), Refusal>;

    /// Gives the update up.
    fn abort(&mut self);

    /// Bytes of the image that were taken.
    fn written(&self) -> u32;

    /// Whether an image is being erased, checked or tested.
    fn is_busy(&self) -> bool;
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

    fn abort(&mut self) {}

    fn written(&self) -> u32 {
        0
    }

    fn is_busy(&self) -> bool {
        false
    }
}
