//! Compares the board's actions with those of the host's executor, by the rule in docs/LINK.md ("State of the head").

use std::collections::HashMap;

use actq_kernels::{Head, Image};
use anyhow::{Context as _, Result};

use crate::bits;

/// A sent item that determines the state of the board's head.
#[derive(Clone, Debug)]
pub(super) enum Sent {
    /// A status.
    Status {
        /// The token, and `true` if the board was reset: the token is then new, whatever its value.
        token: u32,
        was_reset: bool,
        /// CRC-32 of the running image's header.
        image: u32,
    },
    /// An action: the number of its observation, and the bits of its values.
    Action { of: u32, bits: Vec<u32> },
    /// Frames that the board dropped, because its port had no room.
    Dropped,
}

/// Items from a board, and the observations that were sent to it.
#[derive(Clone, Debug, Default)]
pub struct Log {
    pub(super) sent: Vec<Sent>,
    /// The observations by their numbers.
    pub(super) observations: HashMap<u32, Vec<f32>>,
}

/// The actions of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// All.
    pub actions: usize,
    /// Those whose bits differ from the host executor's.
    pub foreign: usize,
    /// Those not compared: the board had dropped frames, and the state of its head was not known again.
    pub unknown: usize,
}

impl Log {
    /// Compares the actions with those of executors of `images`: those that the board ran.
    ///
    /// # Errors
    ///
    /// If an image cannot run, or the board ran another one.
    pub fn compare(&self, images: &[Image<'_>]) -> Result<Compared> {
        let mut memory: Vec<Vec<u32>> = images.iter().map(|image| vec![0; image.scratch_words()]).collect();
        let mut heads = images
            .iter()
            .zip(&mut memory)
            .map(|(image, scratch)| Head::new(*image, scratch))
            .collect::<Result<Vec<_>, _>>()?;
        let mut compared = Compared::default();
        let (mut last_token, mut running) = (None, None);
        // Frames were dropped since the last status: a token that comes next may be in use already.
        let mut dropped = false;
        for sent in &self.sent {
            match sent {
                Sent::Dropped => (dropped, running) = (true, None),
                Sent::Status { token, was_reset, image } => {
                    if last_token != Some(*token) || *was_reset {
                        running = None;
                        if !dropped {
                            let which = images.iter().position(|known| known.crc() == *image);
                            let which =
                                which.with_context(|| format!("the board runs an unknown image, {image:#x}"))?;
                            heads[which].reset();
                            running = Some(which);
                        }
                    }
                    (last_token, dropped) = (Some(*token), false);
                }
                Sent::Action { of, bits: given } => {
                    compared.actions += 1;
                    let Some(which) = running else {
                        compared.unknown += 1;
                        continue;
                    };
                    let observation = self.observations.get(of);
                    let expected = observation.map(|values| heads[which].step(values).map(bits)).transpose()?;
                    compared.foreign += usize::from(expected.as_ref() != Some(given));
                }
            }
        }
        Ok(compared)
    }
}
