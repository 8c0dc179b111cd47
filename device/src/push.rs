//! Sends an image into a controller's other slot.

use std::time::{Duration, Instant};

use actq_link::Message;
use actq_link::code::Refusal;
use actq_link::frame::CRC;
use anyhow::{Context as _, Result, bail, ensure};

use crate::client::Client;

/// The longest payload of a chunk: longer ones gain nothing and lose more where one is damaged.
const MOST: usize = 1024;
/// How long a controller may erase, or check and test.
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

/// Sends an image, and returns once it runs. `progress` is told bytes taken.
///
/// # Errors
///
/// Where the controller refuses it, with the reason; the old image runs on.
pub fn push(client: &mut Client, package: &Package<'_>, mut progress: impl FnMut(usize)) -> Result<()> {
    let Package { image, version, signature } = *package;
    let payload = usize::from(client.status()?.payload);
    // Whole words, beside the offset.
    let chunk = payload.min(MOST).saturating_sub(4) / 4 * 4;
    ensure!(chunk > 0, "the controller's memory for a frame has no room for a part of an image ({payload} bytes)");
    let length = u32::try_from(image.len()).context("the image is longer than 4 GiB")?;
    let crc = CRC.checksum(image);
    let begin = |client: &mut Client| {
        let token = client.status()?.token;
        client.request(&Message::Begin { token, length, crc, version })
    };
    until_done(client, begin)?.context("the update cannot begin")?;
    let mut at = 0;
    progress(at);
    while at < image.len() {
        let bytes = image.get(at..image.len().min(at + chunk)).unwrap_or_default();
        let (written, outcome) = client.request(&Message::Chunk { offset: at as u32, bytes })?;
        match outcome {
            // It tells from where to go on.
            Ok(()) | Err(Refusal::Offset) => {}
            Err(refusal) => bail!("the image's bytes from {at} on are refused: {refusal}"),
        }
        ensure!(written <= length, "the controller says that it has {written} bytes of {length}");
        at = written as usize;
        progress(at);
    }
    until_done(client, |client| client.request(&Message::Commit { signature }))?.context("the image is refused")
}

/// Repeats a request while the controller is busy with it.
fn until_done(
    client: &mut Client,
    mut request: impl FnMut(&mut Client) -> Result<(u32, Result<(), Refusal>)>,
) -> Result<Result<(), Refusal>> {
    let begun = Instant::now();
    loop {
        match request(client)?.1 {
            Err(Refusal::Busy) if begun.elapsed() < BUSY => std::thread::sleep(ASK_AGAIN),
            outcome => return Ok(outcome),
        }
    }
}
