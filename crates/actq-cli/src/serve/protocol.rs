//! The pipe protocol ([`actq_link`]), by which a simulator runs an image as its policy over standard input and output.

use std::io::{ErrorKind, Read, Write};

use actq::runtime::{prefix_len, take_prefix, with_head};
use actq_kernels::Image;
use actq_link::{NO_ACTION, PREFIX, RESET, STEP};
use anyhow::{Context, Result, bail, ensure};

/// A request of the simulator, and its outcome.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen<'a> {
    /// It reset the policy.
    Reset,
    /// It sent this observation, here with its prefix, and the reply was an action.
    Observation(&'a [f32]),
    /// It sent an observation without an action; the head has reset itself.
    NoAction,
}

/// Serves until the input ends. Calls `seen` for every request, after the reply.
pub(crate) fn serve(
    image: Image<'_>,
    mut input: impl Read,
    mut output: impl Write,
    mut seen: impl FnMut(Seen<'_>),
) -> Result<()> {
    let mut observation = vec![0.0; image.obs_len() + prefix_len(&image)];
    let no_action = vec![NO_ACTION; image.act_len()];
    with_head(image, |head| {
        loop {
            let mut command = [0u8];
            match input.read_exact(&mut command) {
                Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(()),
                other => other.context("cannot read the input")?,
            }
            match command[0] {
                RESET => {
                    head.reset();
                    seen(Seen::Reset);
                }
                PREFIX => {
                    ensure!(image.prefix_bytes() > 0, "the image reads no prefix; send none");
                    let (_, prefix) = observation.split_at_mut(image.obs_len());
                    read(&mut input, "a prefix", prefix)?;
                    take_prefix(head, &observation)?;
                }
                STEP => {
                    ensure!(head.has_prefix(), "the image reads a prefix: send P and the keys and values before S");
                    let (own, _) = observation.split_at_mut(image.obs_len());
                    read(&mut input, "an observation", own)?;
                    // After an error the head has reset itself.
                    let (action, what) = match head.step(own) {
                        Ok(action) => (action, Seen::Observation(&observation)),
                        Err(_) => (&no_action[..], Seen::NoAction),
                    };
                    let action: Vec<u8> = action.iter().flat_map(|a| a.to_le_bytes()).collect();
                    let written = output.write_all(&action).and_then(|()| output.flush());
                    seen(what);
                    written.context("cannot write the output")?;
                }
                other => bail!("unknown command byte 0x{other:02x}; send R to reset, S to step or P for a prefix"),
            }
        }
    })
}

/// Reads values, `what` they are.
fn read(input: &mut impl Read, what: &str, values: &mut [f32]) -> Result<()> {
    let mut bytes = vec![0; 4 * values.len()];
    input.read_exact(&mut bytes).with_context(|| format!("the input ends inside {what} of {} bytes", bytes.len()))?;
    values.iter_mut().zip(bytes.as_chunks().0).for_each(|(value, bytes)| *value = f32::from_le_bytes(*bytes));
    Ok(())
}
