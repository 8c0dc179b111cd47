//! Independent heads over one image, stepped on all cores.

use std::fmt;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_kernels::{Head, StepError};
use rayon::prelude::*;
use self_cell::{MutBorrow, self_cell};

/// An image, and the memory of its heads.
struct Memory {
    image: ImageBuffer,
    scratch: MutBorrow<Vec<u32>>,
}

type Heads<'a> = Vec<Head<'a, 'a>>;

self_cell!(
    struct Cell {
        owner: Memory,
        #[not_covariant]
        dependent: Heads,
    }
);

/// Heads that run one image, each with a state of its own.
pub(crate) struct Batch {
    cell: Cell,
    obs_len: usize,
    act_len: usize,
}

/// A head that failed.
#[derive(Debug)]
pub(crate) struct Error {
    head: usize,
    error: StepError,
}

impl std::error::Error for Error {}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "head {}: {}", self.head, self.error)
    }
}

impl Batch {
    /// Makes `heads` heads.
    pub(crate) fn new(bytes: &[u8], heads: usize) -> actq::error::Result<Self> {
        let buffer = ImageBuffer::new(bytes);
        let image = buffer.image(Path::new("image"))?;
        let (obs_len, act_len, words) = (image.obs_len(), image.act_len(), image.scratch_words());
        let memory = Memory { image: buffer, scratch: MutBorrow::new(vec![0; words * heads]) };
        let cell = Cell::try_new(memory, |memory| {
            let image = memory.image.image(Path::new("image"))?;
            let scratch = memory.scratch.borrow_mut().chunks_exact_mut(words);
            scratch.map(|words| Ok(Head::new(image, words)?)).collect::<actq::error::Result<_>>()
        })?;
        Ok(Self { cell, obs_len, act_len })
    }

    /// Steps every head on its row of `observations`, after a reset if `reset` says so.
    pub(crate) fn step(
        &mut self,
        observations: &[f32],
        reset: Option<&[bool]>,
        actions: &mut [f32],
    ) -> Result<(), Error> {
        let (obs_len, act_len) = (self.obs_len, self.act_len);
        self.cell.with_dependent_mut(|_, heads| {
            let step = |head: &mut Head<'_, '_>, i: usize, observation: &[f32], action: &mut [f32]| {
                if reset.is_some_and(|reset| reset[i]) {
                    head.reset();
                }
                match head.step(observation) {
                    Ok(given) => action.copy_from_slice(given),
                    Err(error) => {
                        action.fill(f32::NAN);
                        return Some(Error { head: i, error });
                    }
                }
                None
            };
            let rows = observations.par_chunks_exact(obs_len).zip(actions.par_chunks_exact_mut(act_len));
            let heads = heads.par_iter_mut().enumerate().zip(rows);
            let failed = heads.filter_map(|((i, head), (observation, action))| step(head, i, observation, action));
            // All heads step, whichever fails.
            failed.min_by_key(|failed| failed.head).map_or(Ok(()), Err)
        })
    }

    /// Resets every head.
    pub(crate) fn reset(&mut self) {
        self.cell.with_dependent_mut(|_, heads| heads.iter_mut().for_each(Head::reset));
    }

    /// Gives every head the seed of its noise, and resets it.
    pub(crate) fn seed(&mut self, seeds: &[u32]) {
        self.cell.with_dependent_mut(|_, heads| heads.iter_mut().zip(seeds).for_each(|(head, seed)| head.seed(*seed)));
    }
}
