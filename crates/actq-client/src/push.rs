//! Sends an image to a controller's spare slot.

use std::time::{Duration, Instant};

use actq_link::Message;
use actq_link::code::{Parameter, Refusal};
use actq_link::frame::CRC;
use anyhow::{Context as _, Result, bail, ensure};

use crate::client::Client;

/// Longest payload of a chunk. Longer ones gain nothing, and a damaged one loses more.
const MAX_PAYLOAD: usize = 1024;
/// Longest time for a controller to erase, check and test, or to switch its outputs off.
const BUSY_TIMEOUT: Duration = Duration::from_secs(60);
/// Time between two repetitions of a request to a busy controller.
const ASK_INTERVAL: Duration = Duration::from_millis(20);

/// An image to send, with its metadata.
#[derive(Clone, Copy, Debug)]
pub struct Package<'a> {
    /// Bytes of the image.
    pub image: &'a [u8],
    /// Version of the image.
    pub version: u32,
    /// Signature of the image, if the controller's build requires one.
    pub signature: Option<&'a [u8; 64]>,
}

/// Transfer of an image to a controller, one request at a time: observations may be sent in between.
#[derive(Debug)]
pub struct Push<'a> {
    package: Package<'a>,
    /// Bytes of the image in a frame.
    chunk: usize,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Begin,
    /// This number of bytes is written.
    Write(usize),
    Done,
}

impl<'a> Push<'a> {
    /// Prepares a transfer; asks the controller for its longest frame.
    ///
    /// # Errors
    ///
    /// Fails without an answer, if the controller's frames are too short, or if the image is too long.
    pub fn new(client: &mut Client, package: Package<'a>) -> Result<Self> {
        let payload = usize::from(client.status()?.payload);
        // Whole words, in addition to the offset.
        let chunk = payload.min(MAX_PAYLOAD).saturating_sub(4) / 4 * 4;
        ensure!(chunk > 0, "the controller's longest payload of {payload} bytes is too short for a part of an image");
        u32::try_from(package.image.len()).context("the image is longer than 4 GiB")?;
        Ok(Self { package, chunk, stage: Stage::Begin })
    }

    /// Limits the bytes of the image in a frame to `most`, at least 4, so that observations get through on a slow line.
    pub fn limit_chunks(&mut self, most: usize) {
        self.chunk = self.chunk.min(most.max(4) / 4 * 4);
    }

    /// Returns the bytes that the controller accepted.
    pub const fn taken(&self) -> usize {
        match self.stage {
            Stage::Begin => 0,
            Stage::Write(at) => at,
            Stage::Done => self.package.image.len(),
        }
    }

    /// Makes the next request; returns `true` if the image runs now. The controller may be busy for a while before the
    /// first and the last one, and before any after a disarm.
    ///
    /// # Errors
    ///
    /// Fails with the reason if the controller refuses; the old image continues to run.
    pub fn advance(&mut self, client: &mut Client) -> Result<bool> {
        let Package { image, version, signature } = self.package;
        let length = image.len() as u32;
        match self.stage {
            Stage::Begin => {
                let crc = CRC.checksum(image);
                let begin = |client: &mut Client| client.change(|token| Message::Begin { token, length, crc, version });
                until_done(client, begin)?.context("cannot begin the update")?;
                self.stage = Stage::Write(0);
            }
            Stage::Write(at) if at < image.len() => {
                let bytes = image.get(at..image.len().min(at + self.chunk)).unwrap_or_default();
                let mut written = 0;
                let outcome = until_done(client, |client| {
                    let (taken, outcome) = client.request(&Message::Chunk { offset: at as u32, bytes })?;
                    written = taken;
                    Ok(outcome)
                })?;
                match outcome {
                    // `written` says where to continue.
                    Ok(()) | Err(Refusal::Offset) => {}
                    Err(refusal) => bail!("the controller refuses the image's bytes from {at}: {refusal}"),
                }
                ensure!(written <= length, "the controller reports {written} written bytes of an image of {length}");
                self.stage = Stage::Write(written as usize);
            }
            Stage::Write(_) => {
                until_done(client, |client| Ok(client.request(&Message::Commit { signature })?.1))?
                    .context("the controller refuses the image")?;
                self.stage = Stage::Done;
            }
            Stage::Done => {}
        }
        Ok(self.stage == Stage::Done)
    }
}

/// Sends an image and returns when it runs. Passes the accepted bytes to `progress`.
///
/// # Errors
///
/// Fails as [`Push::new`] and [`Push::advance`] do.
pub fn push(client: &mut Client, package: &Package<'_>, mut progress: impl FnMut(usize)) -> Result<()> {
    let mut push = Push::new(client, *package)?;
    while !push.advance(client)? {
        progress(push.taken());
    }
    Ok(())
}

/// Returns a note that names the controller's axes without limits; an image sent over the link does not set limits.
///
/// # Errors
///
/// Fails without an answer.
pub fn axes_note(client: &mut Client) -> Result<Option<String>> {
    let mut without_limits = Vec::new();
    for axis in 0..client.status()?.axes {
        // Only an axis without limits has no rate.
        if client.get(Parameter::Rate, axis)? == 0.0 {
            without_limits.push(format!("axis {axis}"));
        }
    }
    let note = || format!("the controller will refuse to arm, {}: {}", without_limits.join(", "), Refusal::Limits);
    Ok((!without_limits.is_empty()).then(note))
}

/// Repeats a request while the controller is busy with it.
fn until_done(
    client: &mut Client,
    mut request: impl FnMut(&mut Client) -> Result<Result<(), Refusal>>,
) -> Result<Result<(), Refusal>> {
    let begun = Instant::now();
    loop {
        match request(client)? {
            Err(Refusal::Busy) if begun.elapsed() < BUSY_TIMEOUT => std::thread::sleep(ASK_INTERVAL),
            outcome => return Ok(outcome),
        }
    }
}
