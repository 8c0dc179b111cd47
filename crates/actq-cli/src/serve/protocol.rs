//! The pipe protocol ([`actq_link`]), by which a simulator runs an image as its policy over standard input and output.

use std::io::{ErrorKind, Read, Write};

use actq::runtime::with_head;
use actq_kernels::Image;
use actq_link::{NO_ACTION, RESET, STEP};
use anyhow::{Context, Result, bail, ensure};

/// A request of the simulator, and its outcome.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen<'a> {
    /// It reset the policy.
    Reset,
    /// It sent this observation, and the reply was an action.
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
    ensure!(
        image.prefix_bytes() == 0,
        "the image reads a prefix, keys and values from a host, which a simulator cannot send; only a controller on the \
         link and `Head::set_prefix` take one"
    );
    let mut bytes = vec![0u8; 4 * image.obs_len()];
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
                STEP => {
                    input
                        .read_exact(&mut bytes)
                        .with_context(|| format!("the input ends inside an observation of {} bytes", bytes.len()))?;
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
                    written.context("cannot write the output")?;
                }
                other => bail!("unknown command byte 0x{other:02x}; send R to reset or S to step"),
            }
        }
    })
}
