//! The pipe protocol ([`actq_link`]): any simulator runs an image as its policy through standard input and output.

use std::io::{ErrorKind, Read, Write};

use actq::runtime::with_head;
use actq_kernels::Image;
use actq_link::{NO_ACTION, RESET, STEP};
use anyhow::{Context, Result, bail};

/// What the other side has done with the policy.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen<'a> {
    /// It has reset it.
    Reset,
    /// It has shown it this observation, which was answered by an action.
    Observation(&'a [f32]),
    /// It has shown it something that has no action: the policy has reset itself.
    NoAction,
}

/// Serves until the input ends. `seen` is told of every request, once it has been answered.
pub(crate) fn serve(
    image: Image<'_>,
    mut input: impl Read,
    mut output: impl Write,
    mut seen: impl FnMut(Seen<'_>),
) -> Result<()> {
    let mut bytes = vec![0u8; 4 * image.obs_len()];
    let no_action = vec![NO_ACTION; image.act_len()];
    with_head(image, |head| {
        loop {
            let mut command = [0u8];
            match input.read_exact(&mut command) {
                Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(()),
                other => other.context("input cannot be read")?,
            }
            match command[0] {
                RESET => {
                    head.reset();
                    seen(Seen::Reset);
                }
                STEP => {
                    input
                        .read_exact(&mut bytes)
                        .with_context(|| format!("the input ended inside an observation of {} bytes", bytes.len()))?;
                    let observation: Vec<f32> =
                        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                    // After an error the head has reset itself.
                    let (action, what) = match head.step(&observation) {
                        Ok(action) => (action, Seen::Observation(&observation)),
                        Err(_) => (&no_action[..], Seen::NoAction),
                    };
                    let action: Vec<u8> = action.iter().flat_map(|a| a.to_le_bytes()).collect();
                    let written = output.write_all(&action).and_then(|()| output.flush());
                    seen(what);
                    written.context("output cannot be written")?;
                }
                other => bail!("unknown command byte 0x{other:02x}; R resets, S steps"),
            }
        }
    })
}
