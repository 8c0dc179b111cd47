//! Images in memory, and the executor over them, on the host.

use std::fs;
use std::path::Path;

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

/// Runs `work` with a head over `image` in fresh scratch memory; returns the errors of `work`.
pub fn with_head<T, E: From<HeadError>>(
    image: Image<'_>,
    work: impl FnOnce(&mut Head<'_, '_>) -> Result<T, E>,
) -> Result<T, E> {
    let mut scratch = vec![0u32; image.scratch_words()];
    work(&mut Head::new(image, &mut scratch)?)
}
