//! Writes recordings and other arrays as files in numpy's format .npz.

use std::io::{self, BufWriter, Cursor, Seek, Write};

use ndarray::Axis;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use super::checked::drawn_noise;
use super::dataset::Dataset;
use super::npy::npy_header;
use super::sizes::Sizes;
use crate::error::Result;

/// An element of an array, with its name in numpy.
pub trait Element: Copy {
    /// Type as in `numpy.dtype.str`.
    const DESCR: &str;

    /// Writes the element, the lowest byte first.
    ///
    /// # Errors
    ///
    /// Errors of `to`.
    fn write(self, to: &mut impl Write) -> io::Result<()>;
}

macro_rules! elements {
    ($($element:ty: $descr:literal),*) => {
        $(impl Element for $element {
            const DESCR: &str = $descr;

            fn write(self, to: &mut impl Write) -> io::Result<()> {
                to.write_all(&self.to_le_bytes())
            }
        })*
    };
}

elements!(f32: "<f4", f64: "<f8", i32: "<i4", i64: "<i8", u8: "|u1");

/// Writes an array in numpy's format .npy, its values in row-major order.
///
/// # Errors
///
/// Errors of `to`.
pub fn write_npy<T: Element>(
    to: &mut impl Write,
    shape: &[usize],
    values: impl IntoIterator<Item = T>,
) -> io::Result<()> {
    to.write_all(&npy_header(T::DESCR, shape))?;
    values.into_iter().try_for_each(|value| value.write(to))
}

/// A writer of an .npz archive, uncompressed.
pub struct NpzWriter<W: Write + Seek>(ZipWriter<W>);

impl<W: Write + Seek> NpzWriter<W> {
    /// Makes a writer to `to`.
    pub fn new(to: W) -> Self {
        Self(ZipWriter::new(to))
    }

    /// Adds an array, its values in row-major order.
    ///
    /// # Errors
    ///
    /// Errors of the file.
    pub fn array<T: Element>(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl IntoIterator<Item = T>,
    ) -> Result<()> {
        // The archive sums every write by itself: not element by element.
        let mut member = BufWriter::new(self.begin(name)?);
        write_npy(&mut member, shape, values)?;
        Ok(member.flush()?)
    }

    /// Begins an array; the caller writes its header and elements.
    ///
    /// # Errors
    ///
    /// Errors of the file.
    pub fn begin(&mut self, name: &str) -> Result<&mut impl Write> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.0.start_file(format!("{name}.npy"), options)?;
        Ok(&mut self.0)
    }

    /// Ends the archive.
    ///
    /// # Errors
    ///
    /// Errors of the file.
    pub fn finish(self) -> Result<W> {
        Ok(self.0.finish()?)
    }
}

impl Dataset {
    /// Returns the recording, of these sizes, as an .npz archive, uncompressed. Noise that a reader draws again is left out.
    ///
    /// # Errors
    ///
    /// If it takes more bytes than an archive may have.
    pub fn npz(&self, sizes: Sizes) -> Result<Vec<u8>> {
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        let (obs, noise) = self.obs.view().split_at(Axis(2), sizes.obs);
        npz.array("obs", obs.shape(), obs.iter().copied())?;
        let is_drawn = |(i, value): (usize, &f32)| value.to_bits() == drawn_noise(0, i).to_bits();
        let of_frame = || noise.iter().take(sizes.noise).enumerate();
        if !noise.is_empty() && (self.action.is_some() || !of_frame().all(is_drawn)) {
            npz.array("noise", noise.shape(), noise.iter().copied())?;
        }
        if let Some(action) = &self.action {
            npz.array("action", action.shape(), action.iter().copied())?;
        }
        npz.array("length", &[self.length.len()], self.length.iter().map(|&n| n as i64))?;
        if let Some(state) = &self.state {
            npz.array("state", state.shape(), state.iter().copied())?;
        }
        Ok(npz.finish()?.into_inner())
    }
}
