//! Sends an image to a controller's spare slot, or a prefix to its head.

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

/// A prefix to send: keys and values for the running image's attentions.
#[derive(Clone, Copy, Debug)]
pub struct Prefix<'a> {
    /// The bytes that `Head::set_prefix` of `actq-kernels` takes.
    pub bytes: &'a [u8],
    /// CRC-32 in the header of the image that reads it ([`actq_link::report::Status::image`]).
    pub image: u32,
    /// Control ticks, from the first request's arrival, for which the head may use it.
    pub lifetime: u32,
}

#[derive(Clone, Copy, Debug)]
enum Content<'a> {
    Image(Package<'a>),
    Prefix(Prefix<'a>),
}

impl<'a> Content<'a> {
    const fn name(&self) -> &'static str {
        match self {
            Self::Image(_) => "image",
            Self::Prefix(_) => "prefix",
        }
    }

    const fn bytes(&self) -> &'a [u8] {
        match self {
            Self::Image(package) => package.image,
            Self::Prefix(prefix) => prefix.bytes,
        }
    }

    fn begin(&self, token: u32) -> Message<'a> {
        let (length, crc) = (self.bytes().len() as u32, CRC.checksum(self.bytes()));
        match *self {
            Self::Image(Package { version, .. }) => Message::Begin { token, length, crc, version },
            Self::Prefix(Prefix { image, lifetime, .. }) => {
                Message::BeginPrefix { token, image, length, crc, lifetime }
            }
        }
    }

    const fn chunk<'m>(&self, offset: u32, bytes: &'m [u8]) -> Message<'m> {
        match self {
            Self::Image(_) => Message::Chunk { offset, bytes },
            Self::Prefix(_) => Message::PrefixChunk { offset, bytes },
        }
    }

    const fn commit(&self) -> Message<'a> {
        match self {
            Self::Image(package) => Message::Commit { signature: package.signature },
            Self::Prefix(_) => Message::CommitPrefix,
        }
    }
}

/// Transfer of an image or a prefix to a controller, one request at a time: observations may be sent in between.
#[derive(Debug)]
pub struct Push<'a> {
    content: Content<'a>,
    /// Its bytes in a frame.
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
    /// Prepares the transfer of an image; asks the controller for its longest frame.
    ///
    /// # Errors
    ///
    /// Fails without an answer, if the controller's frames are too short, or if the image is too long.
    pub fn new(client: &mut Client, package: Package<'a>) -> Result<Self> {
        Self::of(client, Content::Image(package))
    }

    /// Prepares the transfer of a prefix, as [`Self::new`] does.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`].
    pub fn prefix(client: &mut Client, prefix: Prefix<'a>) -> Result<Self> {
        Self::of(client, Content::Prefix(prefix))
    }

    fn of(client: &mut Client, content: Content<'a>) -> Result<Self> {
        let payload = usize::from(client.status()?.payload);
        // Whole words, in addition to the offset.
        let chunk = payload.min(MAX_PAYLOAD).saturating_sub(4) / 4 * 4;
        let name = content.name();
        ensure!(chunk > 0, "the controller's longest payload of {payload} bytes is too short for a part of an {name}");
        u32::try_from(content.bytes().len()).with_context(|| format!("the {name} is longer than 4 GiB"))?;
        Ok(Self { content, chunk, stage: Stage::Begin })
    }

    /// Limits the bytes of the content in a frame to `most`, at least 4, so that observations get through on a slow line.
    pub fn limit_chunks(&mut self, most: usize) {
        self.chunk = self.chunk.min(most.max(4) / 4 * 4);
    }

    /// Returns the bytes that the controller accepted.
    pub const fn taken(&self) -> usize {
        match self.stage {
            Stage::Begin => 0,
            Stage::Write(at) => at,
            Stage::Done => self.content.bytes().len(),
        }
    }

    /// Makes the next request; returns `true` if the image runs now, or if the head has the prefix. The controller may be
    /// busy for a while before the first and the last one, and before any after a disarm.
    ///
    /// # Errors
    ///
    /// Fails with the reason if the controller refuses; the old image continues to run, and the old prefix is used to the
    /// end of its lifetime.
    pub fn advance(&mut self, client: &mut Client) -> Result<bool> {
        let (content, bytes, name) = (self.content, self.content.bytes(), self.content.name());
        match self.stage {
            Stage::Begin => {
                until_done(client, |client| client.change(|token| content.begin(token)))?
                    .with_context(|| format!("cannot begin the {}", if name == "image" { "update" } else { name }))?;
                self.stage = Stage::Write(0);
            }
            Stage::Write(at) if at < bytes.len() => {
                let part = bytes.get(at..bytes.len().min(at + self.chunk)).unwrap_or_default();
                let mut written = 0;
                let outcome = until_done(client, |client| {
                    let (taken, outcome) = client.request(&content.chunk(at as u32, part))?;
                    written = taken as usize;
                    Ok(outcome)
                })?;
                match outcome {
                    // `written` says where to continue.
                    Ok(()) | Err(Refusal::Offset) => {}
                    Err(refusal) => bail!("the controller refuses the {name}'s bytes from {at}: {refusal}"),
                }
                let length = bytes.len();
                ensure!(written <= length, "the controller reports {written} written bytes of an {name} of {length}");
                self.stage = Stage::Write(written);
            }
            Stage::Write(_) => {
                until_done(client, |client| Ok(client.request(&content.commit())?.1))?
                    .with_context(|| format!("the controller refuses the {name}"))?;
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

/// Sends a prefix and returns when the head has it.
///
/// # Errors
///
/// Fails as [`Push::prefix`] and [`Push::advance`] do.
pub fn push_prefix(client: &mut Client, prefix: &Prefix<'_>) -> Result<()> {
    let mut push = Push::prefix(client, *prefix)?;
    while !push.advance(client)? {}
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
