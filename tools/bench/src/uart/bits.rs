//! Compares the board's actions with those of the host's executor.

use std::collections::HashMap;

use actq_kernels::{Head, Image};
use anyhow::Result;

use crate::bits;

/// An action of the board's head.
#[derive(Clone, Debug)]
pub struct HeadAction {
    /// Number of the observation.
    pub of: u32,
    /// Bits of the values.
    pub bits: Vec<u32>,
}

/// Counts the board's actions, in their order, that no head of these images computes on their observations: continued
/// from the previous action, from a reset, or as the first action of the next image. Also counts the restarts of a
/// head.
pub fn count_foreign(
    reported: &[HeadAction],
    shown: &HashMap<u32, Vec<f32>>,
    images: &[Image<'_>],
) -> Result<(usize, usize)> {
    let mut memory: Vec<Vec<u32>> = images.iter().map(|image| vec![0; image.scratch_words()]).collect();
    let mut heads = images
        .iter()
        .zip(&mut memory)
        .map(|(image, scratch)| Head::new(*image, scratch))
        .collect::<Result<Vec<_>, _>>()?;
    let (mut foreign, mut anew, mut current) = (0, 0, 0);
    for reported in reported {
        let Some(observation) = shown.get(&reported.of) else {
            foreign += 1;
            continue;
        };
        if bits(heads[current].step(observation)?) == reported.bits {
            continue;
        }
        anew += 1;
        let found = (current..heads.len()).find_map(|which| {
            let head = heads.get_mut(which)?;
            head.reset();
            let same = head.step(observation).is_ok_and(|action| bits(action) == reported.bits);
            same.then_some(which)
        });
        match found {
            Some(which) => current = which,
            None => foreign += 1,
        }
    }
    Ok((foreign, anew))
}
