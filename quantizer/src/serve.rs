//! The pipe protocol: any simulator runs an image as its policy through standard input and output.
//!
//! Little-endian. `R` resets and has no reply; `S` and the observation (f32) are answered by the action (f32). Chunks are
//! queued inside. Where the observation or a value inside the network is not finite, the answer is [`NO_ACTION`] for every
//! value: there is no action. The recurrent state and what was left of a chunk are forgotten; the last action is kept, so that
//! the step limit still counts from it. Serving goes on. The firmware demo speaks the same protocol.

use std::io::{ErrorKind, Read, Write};

use actq_kernels::Image;
use anyhow::{Context, Result, bail};

use crate::runtime::with_head;

/// The value of an answer without an action: a quiet NaN.
pub const NO_ACTION: f32 = f32::from_bits(0x7fc0_0000);

/// Serves until the input ends.
pub fn serve(image: Image<'_>, mut input: impl Read, mut output: impl Write) -> Result<()> {
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
                b'R' => head.reset(),
                b'S' => {
                    input
                        .read_exact(&mut bytes)
                        .with_context(|| format!("the input ended inside an observation of {} bytes", bytes.len()))?;
                    let observation: Vec<f32> =
                        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                    // After an error the head has reset itself.
                    let action = head.step(&observation).unwrap_or(&no_action);
                    let action: Vec<u8> = action.iter().flat_map(|a| a.to_le_bytes()).collect();
                    output.write_all(&action).and_then(|()| output.flush()).context("output cannot be written")?;
                }
                other => bail!("unknown command byte 0x{other:02x}; R resets, S steps"),
            }
        }
    })
}
