//! Sends an image into a controller's other slot.

use std::time::{Duration, Instant};

use actq_link::Message;
use actq_link::code::{Parameter, Refusal};
use actq_link::frame::CRC;
use anyhow::{Context as _, Result, bail, ensure};

use crate::client::Client;

/// The longest payload of a chunk: longer ones gain nothing and lose more where one is damaged.
const MOST: usize = 1024;
/// How long a controller may erase, check and test, or switch its outputs off.
const BUSY: Duration = Duration::from_secs(60);
/// Between two questions whether it is done.
const ASK_AGAIN: Duration = Duration::from_millis(20);

/// What an image is sent with.
#[derive(Clone, Copy, Debug)]
pub struct Package<'a> {
    /// Its bytes.
    pub image: &'a [u8],
    /// Its version.
    pub version: u32,
    /// Its signature, where the controller's build asks for one.
    pub signature: Option<&'a [u8; 64]>,
}

/// An image on its way into a controller, a request at a time: observations may be sent in between.
#[derive(Debug)]
pub struct Push<'a> {
    package: Package<'a>,
    /// Of an image's bytes in a frame.
    chunk: usize,
    stage: Stage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Begin,
    /// So many bytes are written.
    Write(usize),
    Done,
}

impl<'a> Push<'a> {
    /// Asks the controller how much it takes at once.
    ///
    /// # Errors
    ///
    /// Where there is no answer, or the image or the controller's memory is of no use.
    pub fn new(client: &mut Client, package: Package<'a>) -> Result<Self> {
        let payload = usize::from(client.status()?.payload);
        // Whole words, beside the offset.
        let chunk = payload.min(MOST).saturating_sub(4) / 4 * 4;
        ensure!(chunk > 0, "the controller's memory for a frame has no room for a part of an image ({payload} bytes)");
        u32::try_from(package.image.len()).context("the image is longer than 4 GiB")?;
        Ok(Self { package, chunk, stage: Stage::Begin })
    }

    /// Sends at most so many bytes in a frame: where the line is slow, observations go in between. At least 4.
    pub fn in_chunks_of(&mut self, most: usize) {
        self.chunk = self.chunk.min(most.max(4) / 4 * 4);
    }

    /// Bytes that the controller has taken.
    pub const fn taken(&self) -> usize {
        match self.stage {
            Stage::Begin => 0,
            Stage::Write(at) => at,
            Stage::Done => self.package.image.len(),
        }
    }

    /// Does the next request; whether the image runs now. Before the first and the last one the controller may be busy
    /// for a while, and before any where it was just disarmed.
    ///
    /// # Errors
    ///
    /// Where the controller refuses it, with the reason; the old image runs on.
    pub fn advance(&mut self, client: &mut Client) -> Result<bool> {
        let Package { image, version, signature } = self.package;
        let length = image.len() as u32;
        match self.stage {
            Stage::Begin => {
                let crc = CRC.checksum(image);
                let begin = |client: &mut Client| client.change(|token| Message::Begin { token, length, crc, version });
                until_done(client, begin)?.context("the update cannot begin")?;
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
                    // It tells from where to go on.
                    Ok(()) | Err(Refusal::Offset) => {}
                    Err(refusal) => bail!("the image's bytes from {at} on are refused: {refusal}"),
                }
                ensure!(written <= length, "the controller says that it has {written} bytes of {length}");
                self.stage = Stage::Write(written as usize);
            }
            Stage::Write(_) => {
                until_done(client, |client| Ok(client.request(&Message::Commit { signature })?.1))?
                    .context("the image is refused")?;
                self.stage = Stage::Done;
            }
            Stage::Done => {}
        }
        Ok(self.stage == Stage::Done)
    }
}

/// Sends an image, and returns once it runs. `progress` is told bytes taken.
///
/// # Errors
///
/// As [`Push::new`] and [`Push::advance`].
pub fn push(client: &mut Client, package: &Package<'_>, mut progress: impl FnMut(usize)) -> Result<()> {
    let mut push = Push::new(client, *package)?;
    while !push.advance(client)? {
        progress(push.taken());
    }
    Ok(())
}

/// A note on axes of the controller without limits, which no image that is sent brings.
///
/// # Errors
///
/// Where there is no answer.
pub fn axes_note(client: &mut Client) -> Result<Option<String>> {
    let mut still = Vec::new();
    for axis in 0..client.status()?.axes {
        // Only what has no limits has no rate.
        if client.get(Parameter::Rate, axis)? == 0.0 {
            still.push(format!("axis {axis}"));
        }
    }
    let note = || format!("the controller will refuse to arm, {}: {}", still.join(", "), Refusal::Limits);
    Ok((!still.is_empty()).then(note))
}

/// Repeats a request while the controller is busy with it.
fn until_done(
    client: &mut Client,
    mut request: impl FnMut(&mut Client) -> Result<Result<(), Refusal>>,
) -> Result<Result<(), Refusal>> {
    let begun = Instant::now();
    loop {
        match request(client)? {
            Err(Refusal::Busy) if begun.elapsed() < BUSY => std::thread::sleep(ASK_AGAIN),
            outcome => return Ok(outcome),
        }
    }
}
