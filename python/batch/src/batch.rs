//! A batch of heads.

use actq_kernels::{Head, Image, ImageError, PortKind, StepError};
use fearless_simd::Level;
use rayon::prelude::*;
use self_cell::{MutBorrow, self_cell};

use crate::error::Error;
use crate::program::{Operation, operations};
use crate::tile::{self, Tile, Work};

/// The words of the image, and the scratch memory of all heads.
struct Memory {
    image: Vec<u32>,
    scratch: MutBorrow<Vec<u32>>,
}

/// The image and the heads in their memory.
struct Heads<'m> {
    image: Image<'m>,
    heads: Vec<Head<'m, 'm>>,
}

self_cell! {
    struct OwnedHeads {
        owner: Memory,
        #[covariant]
        dependent: Heads,
    }
}

/// The number of a tile, its heads, and the room for their actions.
type Part<'p, 'm> = (usize, (&'p mut [Head<'m, 'm>], &'p mut [f32]));

/// Independent heads of one image.
pub struct Batch {
    heads: OwnedHeads,
    program: Vec<Operation>,
    /// Lowest and highest value that a step accepts, for each value of an observation; empty without limits.
    ranges: Vec<[f32; 2]>,
    level: Level,
}

impl std::fmt::Debug for Batch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Batch")
            .field("image", &self.image().name())
            .field("heads", &self.heads())
            .finish_non_exhaustive()
    }
}

impl Batch {
    /// Creates a batch of `heads` heads of an image, whose bytes may have any alignment. Each head starts as
    /// [`Head::new`] does, with the seed 0.
    ///
    /// # Errors
    ///
    /// [`Error::Image`], [`Error::NoHeads`], and [`Error::Memory`] if the memory for the heads is not available.
    pub fn new(image: &[u8], heads: usize) -> Result<Self, Error> {
        Self::at_level(Level::new(), image, heads)
    }

    pub(crate) fn at_level(level: Level, bytes: &[u8], heads: usize) -> Result<Self, Error> {
        if heads == 0 {
            return Err(Error::NoHeads);
        }
        let (words, rest) = bytes.as_chunks();
        if !rest.is_empty() {
            return Err(ImageError::Length.into());
        }
        let image: Vec<u32> = words.iter().map(|word| u32::from_ne_bytes(*word)).collect();
        let per_head = checked(&image)?.scratch_words();
        let memory = Memory { image, scratch: MutBorrow::new(zeros(heads, per_head).ok_or(Error::Memory { heads })?) };
        let heads = OwnedHeads::try_new(memory, |memory| -> Result<Heads<'_>, Error> {
            let image = checked(&memory.image)?;
            let scratch = memory.scratch.borrow_mut().chunks_exact_mut(per_head);
            let mut all = Vec::new();
            all.try_reserve_exact(heads).map_err(|_| Error::Memory { heads })?;
            // A chunk has the words that a head needs.
            all.extend(scratch.filter_map(|scratch| Head::new(image, scratch).ok()));
            Ok(Heads { image, heads: all })
        })?;
        let image = &heads.borrow_dependent().image;
        let inputs = image.ports().filter(|port| port.kind == PortKind::Input);
        let ranges = inputs.flat_map(|port| std::iter::repeat_n(port.range, port.len)).collect();
        let program = operations(image);
        Ok(Self { heads, program, ranges, level })
    }

    /// Returns the image.
    pub fn image(&self) -> &Image<'_> {
        &self.heads.borrow_dependent().image
    }

    /// Returns the number of heads.
    pub fn heads(&self) -> usize {
        self.heads.borrow_dependent().heads.len()
    }

    /// Returns the number of values of an observation.
    pub fn obs_len(&self) -> usize {
        self.image().obs_len()
    }

    /// Returns the number of values of an action.
    pub fn act_len(&self) -> usize {
        self.image().act_len()
    }

    /// Resets every head, as [`Head::reset`] does.
    pub fn reset(&mut self) {
        self.each(|_, head| head.reset());
    }

    /// Sets the seed of each head's noise, and resets every head, as [`Head::seed`] does.
    ///
    /// # Errors
    ///
    /// [`Error::Seeds`] if there is not one seed for each head.
    pub fn seed(&mut self, seeds: &[u32]) -> Result<(), Error> {
        let (expected, given) = (self.heads(), seeds.len());
        if expected != given {
            return Err(Error::Seeds { expected, given });
        }
        self.each(|i, head| head.seed(seeds[i]));
        Ok(())
    }

    fn each(&mut self, work: impl Fn(usize, &mut Head<'_, '_>)) {
        self.heads.with_dependent_mut(|_, Heads { heads, .. }| {
            heads.iter_mut().enumerate().for_each(|(i, head)| work(i, head));
        });
    }

    /// Computes the next action of each head, as [`Head::step`] does. `observations` has a row of [`Self::obs_len`]
    /// values for each head, `actions` gets a row of [`Self::act_len`] values. A head for which `reset` is `true` is
    /// reset before its step.
    ///
    /// It runs on the threads of rayon's current pool; `ThreadPool::install` selects another.
    ///
    /// # Errors
    ///
    /// [`Error::Observations`], [`Error::Actions`] and [`Error::Reset`] for lengths, and [`Error::Head`] for an
    /// observation that [`Head::step`] refuses. All observations are checked before anything changes: no head has made
    /// a step or was reset, and `actions` is as before.
    ///
    /// [`Error::Head`] also if a head fails inside its network ([`StepError::NotFinite`]). The other heads have made
    /// their step, and their actions are valid. The actions of all heads that have failed are NaN, and their next steps
    /// continue as [`Head::step`] documents: the recurrent state and the chunk are reset, and the last action stays.
    pub fn step(&mut self, observations: &[f32], reset: Option<&[bool]>, actions: &mut [f32]) -> Result<(), Error> {
        let (heads, obs_len, act_len) = (self.heads(), self.obs_len(), self.act_len());
        let (expected, given) = (heads * obs_len, observations.len());
        if expected != given {
            return Err(Error::Observations { expected, given });
        }
        let (expected, given) = (heads * act_len, actions.len());
        if expected != given {
            return Err(Error::Actions { expected, given });
        }
        if let Some(given) = reset.map(<[bool]>::len).filter(|given| *given != heads) {
            return Err(Error::Reset { expected: heads, given });
        }
        let mut rows = observations.chunks_exact(obs_len).enumerate();
        if let Some((head, error)) = rows.find_map(|(head, row)| Some((head, self.check(row)?))) {
            return Err(Error::Head { head, error });
        }
        let (level, program) = (self.level, &self.program[..]);
        let size = heads.div_ceil(rayon::current_num_threads()).next_multiple_of(tile::LEAST).min(tile::MOST);
        let step = |work: &mut Work, (i, (heads, actions)): Part<'_, '_>| {
            let from = i * size;
            let observations = &observations[from * obs_len..][..heads.len() * obs_len];
            let reset = reset.map(|reset| &reset[from..][..heads.len()]);
            let (head, error) = Tile { heads, observations, reset, actions }.step(level, program, work)?;
            Some(Error::Head { head: from + head, error })
        };
        let failed = self.heads.with_dependent_mut(|_, Heads { heads, .. }| {
            if heads.len() <= size {
                return step(&mut Work::default(), (0, (heads, actions)));
            }
            let tiles = heads.par_chunks_mut(size).zip(actions.par_chunks_mut(size * act_len)).enumerate();
            // The first of all, whichever thread is done first.
            tiles.map_init(Work::default, step).collect::<Vec<_>>().into_iter().flatten().next()
        });
        failed.map_or(Ok(()), Err)
    }

    /// Returns the error of [`Head::step`] for an observation.
    fn check(&self, observation: &[f32]) -> Option<StepError> {
        if let Some(index) = observation.iter().position(|value| !value.is_finite()) {
            return Some(StepError::ObservationNotFinite { index });
        }
        let mut ranges = observation.iter().zip(&self.ranges);
        ranges
            .position(|(value, [low, high])| !(low..=high).contains(&value))
            .map(|index| StepError::ObservationRange { index })
    }
}

fn checked(words: &[u32]) -> Result<Image<'_>, ImageError> {
    Image::new_checked(bytemuck::must_cast_slice(words))
}

/// Returns zeros for all heads, if there is memory.
fn zeros(heads: usize, per_head: usize) -> Option<Vec<u32>> {
    let len = heads.checked_mul(per_head)?;
    let mut zeros = Vec::new();
    zeros.try_reserve_exact(len).ok()?;
    zeros.resize(len, 0);
    Some(zeros)
}
