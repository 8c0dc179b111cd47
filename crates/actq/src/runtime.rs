//! Images in memory, and the executor over them, on the host.

use std::fs;
use std::path::Path;

use actq_kernels::image::Cache;
use actq_kernels::image::header::MAGIC;
use actq_kernels::{Head, HeadError, Image};

use crate::error::{Context, Result, ensure};

/// The bytes of an image at an address that is a multiple of 4.
#[derive(Clone, Debug)]
pub struct ImageBuffer {
    words: Vec<u32>,
    len: usize,
}

impl ImageBuffer {
    /// Copies `bytes`.
    pub fn new(bytes: &[u8]) -> Self {
        let mut words = vec![0u32; bytes.len().div_ceil(4)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self { words, len: bytes.len() }
    }

    /// Reads a file; an error names it.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).with_context(|| format!("{}: cannot read the file", path.display()))?;
        Ok(Self::new(&bytes))
    }

    /// Returns the bytes.
    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }

    /// Parses the image; an error names `path`.
    pub fn image(&self, path: &Path) -> Result<Image<'_>> {
        let magic = MAGIC.to_le_bytes();
        ensure!(self.bytes().starts_with(&magic), "{}: not an actq image", path.display());
        Image::new_checked(self.bytes()).with_context(|| path.display().to_string())
    }
}

/// Returns the values of an image's prefix in a recording's row, which follow the observation: for each cache its keys, then
/// its values, of all slots.
pub fn prefix_len(image: &Image<'_>) -> usize {
    image.prefix_caches().map(|cache| 2 * cache.prefix_slots() * cache.heads * cache.dim).sum()
}

/// Splits the [`prefix_len`] values of a row into keys and values of each cache.
pub fn keys_and_values<'r>(image: &Image<'_>, mut values: &'r [f32]) -> Vec<(Cache, [&'r [f32]; 2])> {
    let mut part = |len: usize| {
        let (part, rest) = values.split_at_checked(len).unwrap_or((values, &[]));
        values = rest;
        part
    };
    let of_cache = |cache: Cache| {
        let len = cache.prefix_slots() * cache.heads * cache.dim;
        (cache, [part(len), part(len)])
    };
    image.prefix_caches().map(of_cache).collect()
}

/// Returns the bytes of a prefix ([`Head::set_prefix`]): keys and values of each cache of the image, each [token, head,
/// element], of one token up to all slots.
///
/// # Errors
///
/// Names the cache whose keys and values are not as above, or if their number is not that of the caches.
pub fn prefix_bytes(image: &Image<'_>, keys_and_values: &[[&[f32]; 2]]) -> Result<Vec<u8>> {
    let caches: Vec<Cache> = image.prefix_caches().collect();
    ensure!(
        caches.len() == keys_and_values.len(),
        "the image's prefix has {} caches; keys and values of {} were given",
        caches.len(),
        keys_and_values.len()
    );
    let mut bytes = Vec::new();
    for (i, (cache, [keys, values])) in caches.into_iter().zip(keys_and_values).enumerate() {
        let mut words = vec![0; cache.words()];
        cache.fill(keys, values, &mut words).with_context(|| format!("cache {i} of the prefix"))?;
        bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
    }
    Ok(bytes)
}

/// Does the same as [`prefix_bytes`] from the [`prefix_len`] values of a recording's row.
pub fn prefix_of_row(image: &Image<'_>, values: &[f32]) -> Result<Vec<u8>> {
    let parts: Vec<_> = keys_and_values(image, values).into_iter().map(|(_, part)| part).collect();
    prefix_bytes(image, &parts)
}

/// Refuses an image that reads a prefix, for `what` cannot set one.
///
/// # Errors
///
/// Names the commands that can.
pub fn refuse_prefix(image: &Image<'_>, what: &str) -> Result<()> {
    ensure!(
        image.prefix_bytes() == 0,
        "the image reads a prefix, keys and values from a host, which {what} does not set; `actq eval`, `actq serve` and \
         `actq link stream` do"
    );
    Ok(())
}

/// Gives a head the prefix in a recording's row of [observation, prefix, noise], and returns observation and noise.
///
/// # Errors
///
/// If the row is too short, or a key or a value is not finite.
pub fn take_prefix<'r>(head: &mut Head<'_, '_>, row: &'r [f32]) -> Result<(&'r [f32], &'r [f32])> {
    let image = *head.image();
    let (observation, rest) = row.split_at_checked(image.obs_len()).context("the row is no observation")?;
    let (prefix, noise) = rest.split_at_checked(prefix_len(&image)).context("the observation has no prefix")?;
    if !prefix.is_empty() {
        head.set_prefix(&prefix_of_row(&image, prefix)?)?;
    }
    Ok((observation, noise))
}

/// Runs `work` with a head over `image` in fresh scratch memory; returns the errors of `work`.
pub fn with_head<T, E: From<HeadError>>(
    image: Image<'_>,
    work: impl FnOnce(&mut Head<'_, '_>) -> Result<T, E>,
) -> Result<T, E> {
    let mut scratch = vec![0u32; image.scratch_words()];
    work(&mut Head::new(image, &mut scratch)?)
}
