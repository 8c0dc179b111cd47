//! A batch of heads.

use actq_kernels::{Head, Image, ImageError, Parked, PortKind, StepError};
use fearless_simd::Level;
use rayon::prelude::*;
use self_cell::self_cell;

use crate::error::Error;
use crate::program::{Operation, operations};
use crate::tile::{self, Tile, Work};

self_cell! {
    /// An image and its words.
    struct OwnedImage {
        owner: Vec<u32>,
        #[covariant]
        dependent: Image,
    }
}

/// The number of a tile, its heads with their words, and the room for their actions.
type Part<'p> = (usize, ((&'p mut [Parked], &'p mut [u32]), &'p mut [f32]));

/// Independent heads of one image.
pub struct Batch {
    image: OwnedImage,
    heads: Vec<Parked>,
    /// The words of each parked head, one head after the other. The memory that a step works in is a thread's, so that the
    /// heads of a large batch stay in the machine's caches.
    words: Vec<u32>,
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
        let words = words.iter().map(|word| u32::from_ne_bytes(*word)).collect();
        let owned = OwnedImage::try_new(words, |words| checked(words))?;
        let image = owned.borrow_dependent();
        let mut first = vec![0; Parked::words(image)];
        let mut scratch = vec![0; image.scratch_words()];
        let Ok(head) = Head::new(*image, &mut scratch) else { return Err(Error::Memory { heads }) };
        let parked = head.park(&mut first);
        let mut all = Vec::new();
        all.try_reserve_exact(heads).map_err(|_| Error::Memory { heads })?;
        all.resize(heads, parked);
        let mut words = zeros(heads, first.len()).ok_or(Error::Memory { heads })?;
        words.chunks_exact_mut(first.len()).for_each(|words| words.copy_from_slice(&first));
        let inputs = image.ports().filter(|port| port.kind == PortKind::Input);
        let ranges = inputs.flat_map(|port| std::iter::repeat_n(port.range, port.len)).collect();
        let program = operations(level, image);
        Ok(Self { image: owned, heads: all, words, program, ranges, level })
    }

    /// Returns the image.
    pub fn image(&self) -> &Image<'_> {
        self.image.borrow_dependent()
    }

    /// Returns the number of heads.
    pub fn heads(&self) -> usize {
        self.heads.len()
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

    /// Returns the state of each head as [`Head::save`] writes it, a row of [`Head::saved_len`] bytes for each.
    ///
    /// # Errors
    ///
    /// [`Error::Saved`] as [`Head::save`].
    pub fn save(&self) -> Result<Vec<u8>, Error> {
        let image = *self.image();
        let (mut rows, mut scratch) = (Vec::new(), vec![0; image.scratch_words()]);
        let words = self.words.chunks_exact(Parked::words(&image));
        for (head, (parked, words)) in self.heads.iter().zip(words).enumerate() {
            // The memory has the words that a head needs.
            let Ok(from) = parked.resume(image, words, &mut scratch) else { break };
            let at = rows.len();
            rows.resize(at + from.saved_len(), 0);
            from.save(&mut rows[at..]).map_err(|error| Error::Saved { head, error })?;
        }
        Ok(rows)
    }

    /// Restores the state of each head, as [`Head::restore`] does, from rows that [`Self::save`] returned. A row may
    /// come from any batch of the same image.
    ///
    /// # Errors
    ///
    /// [`Error::States`] if there is not one row for each head, and [`Error::Saved`] for a row that [`Head::restore`]
    /// refuses: then every head keeps its state.
    pub fn restore(&mut self, rows: &[u8]) -> Result<(), Error> {
        let before = self.save()?;
        let (expected, given) = (before.len(), rows.len());
        if expected != given {
            return Err(Error::States { expected, given });
        }
        let len = expected / self.heads();
        self.change(&before, |i, head| {
            let restored = head.restore(&rows[i * len..][..len]);
            restored.map_err(|error| Error::Saved { head: i, error })
        })
    }

    /// Sets the prefix of each head, as [`Head::set_prefix`] does, from rows of [`Image::prefix_bytes`] bytes.
    ///
    /// # Errors
    ///
    /// [`Error::Prefixes`] if there is not one row for each head, and [`Error::Prefix`] for a row that
    /// [`Head::set_prefix`] refuses: then every head keeps its prefix.
    pub fn set_prefix(&mut self, rows: &[u8]) -> Result<(), Error> {
        let len = self.image().prefix_bytes();
        let (expected, given) = (self.heads() * len, rows.len());
        if expected != given {
            return Err(Error::Prefixes { expected, given });
        }
        let before = self.save()?;
        self.change(&before, |i, head| {
            let set = head.set_prefix(&rows[i * len..][..len]);
            set.map_err(|error| Error::Prefix { head: i, error })
        })
    }

    /// Clears the prefix of each head, as [`Head::clear_prefix`] does.
    pub fn clear_prefix(&mut self) {
        self.each(|_, head| head.clear_prefix());
    }

    /// Changes each head. After an error every head has its state of `before`, and the first error is returned.
    fn change(
        &mut self,
        before: &[u8],
        mut work: impl FnMut(usize, &mut Head<'_, '_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut failed = None;
        self.each(|i, head| failed = failed.or(work(i, head).err()));
        let Some(error) = failed else { return Ok(()) };
        self.restore(before)?;
        Err(error)
    }

    fn each(&mut self, mut work: impl FnMut(usize, &mut Head<'_, '_>)) {
        let image = *self.image.borrow_dependent();
        let mut scratch = vec![0; image.scratch_words()];
        let words = self.words.chunks_exact_mut(Parked::words(&image));
        for (i, (parked, words)) in self.heads.iter_mut().zip(words).enumerate() {
            // The memory has the words that a head needs.
            let Ok(mut head) = parked.resume(image, words, &mut scratch) else { return };
            work(i, &mut head);
            *parked = head.park(words);
        }
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
        let (image, words) = (*self.image.borrow_dependent(), Parked::words(self.image.borrow_dependent()));
        let step = |work: &mut Work, (i, ((heads, words), actions)): Part<'_>| {
            let from = i * size;
            let observations = &observations[from * obs_len..][..heads.len() * obs_len];
            let reset = reset.map(|reset| &reset[from..][..heads.len()]);
            let tile = Tile { image, heads, words, observations, reset, actions };
            let (head, error) = tile.step(level, program, work)?;
            Some(Error::Head { head: from + head, error })
        };
        let failed = if heads <= size {
            step(&mut Work::default(), (0, ((&mut self.heads, &mut self.words), actions)))
        } else {
            let tiles = self.heads.par_chunks_mut(size).zip(self.words.par_chunks_mut(size * words));
            let tiles = tiles.zip(actions.par_chunks_mut(size * act_len)).enumerate();
            // The first of all, whichever thread is done first.
            tiles.map_init(Work::default, step).collect::<Vec<_>>().into_iter().flatten().next()
        };
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
