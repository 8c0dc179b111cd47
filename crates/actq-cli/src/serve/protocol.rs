//! The pipe protocol ([`actq_link`]), by which a simulator runs an image as its policy over standard input and output.

use std::io::{ErrorKind, Read, Write};

use actq::runtime::{prefix_len, take_prefix, with_head};
use actq_kernels::{Head, Image, StepError};
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

/// A head whose network takes some control periods.
struct Late {
    periods: usize,
    /// Periods until the step that has begun is ready.
    left: Option<usize>,
    /// The last action; before the first one, none.
    action: Vec<f32>,
}

impl Late {
    fn reset(&mut self) {
        self.left = None;
        self.action.fill(NO_ACTION);
    }

    /// Sets the action for an observation as the controller does: the one that is ready, else what the chunk before
    /// predicts, else the last one again. After an error no step is left.
    fn step(&mut self, head: &mut Head<'_, '_>, observation: &[f32]) -> Result<(), StepError> {
        let left = self.left.take();
        if let Some(left @ 1..) = left {
            self.left = Some(left - 1);
        } else {
            if left.is_some() {
                self.action.copy_from_slice(head.finish_ops()?);
                if head.image().chunk() > 1 {
                    return Ok(());
                }
                // A single action is for no particular period: the next step begins at once.
            }
            head.begin_ops(observation)?;
            // A step that continues a chunk has no operation left.
            if head.next_op().is_none() || self.periods == 0 {
                self.action.copy_from_slice(head.finish_ops()?);
                return Ok(());
            }
            self.left = Some(self.periods - 1);
        }
        match head.play() {
            Ok(action) => self.action.copy_from_slice(action),
            Err(StepError::Stale) => head.pass(1),
            Err(error) => {
                self.left = None;
                return Err(error);
            }
        }
        Ok(())
    }
}

/// Serves until the input ends, with a network that takes `late` control periods. Calls `seen` for every request, after the
/// reply.
pub(crate) fn serve(
    image: Image<'_>,
    late: usize,
    mut input: impl Read,
    mut output: impl Write,
    mut seen: impl FnMut(Seen<'_>),
) -> Result<()> {
    let mut observation = vec![0.0; image.obs_len() + prefix_len(&image)];
    let no_action = vec![NO_ACTION; image.act_len()];
    let mut late = Late { periods: late, left: None, action: no_action.clone() };
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
                    late.reset();
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
                    let (action, what) = match late.step(head, own) {
                        Ok(()) => (&late.action, Seen::Observation(&observation)),
                        Err(_) => (&no_action, Seen::NoAction),
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
