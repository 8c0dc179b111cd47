//! Rows of values on disk, until the recording's array has its final length.

use std::fs::File;
use std::io::{self, BufWriter, Read as _, Seek as _, SeekFrom, Write};
use std::path::Path;

use actq::data::npy_header;

/// Bytes in memory before a write.
const BUFFER: usize = 1 << 16;

/// Rows in order, in a file without a name, which the system removes when the process ends.
#[derive(Debug)]
pub(super) struct Spool {
    width: usize,
    rows: BufWriter<File>,
}

impl Spool {
    /// Creates a spool for rows of `width` values on the disk of `folder`.
    pub(super) fn new(folder: &Path, width: usize) -> io::Result<Self> {
        Ok(Self { width, rows: BufWriter::with_capacity(BUFFER, tempfile::tempfile_in(folder)?) })
    }

    /// Returns the number of values in a row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Appends a row.
    pub(super) fn push(&mut self, row: &[f32]) -> io::Result<()> {
        debug_assert_eq!(row.len(), self.width);
        row.iter().try_for_each(|value| self.rows.write_all(&value.to_le_bytes()))
    }

    /// Writes the rows as an array `[episode, step, value]` in .npy format, with zeros after every episode's end.
    pub(super) fn write_npy(&mut self, lengths: &[usize], to: &mut impl Write) -> io::Result<()> {
        let longest = lengths.iter().copied().max().unwrap_or(0);
        let bytes = |steps: usize| 4 * (steps * self.width) as u64;
        to.write_all(&npy_header("<f4", &[lengths.len(), longest, self.width]))?;
        self.rows.seek(SeekFrom::Start(0))?;
        for &length in lengths {
            let copied = io::copy(&mut self.rows.get_ref().take(bytes(length)), to)?;
            if copied < bytes(length) {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            io::copy(&mut io::repeat(0).take(bytes(longest - length)), to)?;
        }
        self.rows.seek(SeekFrom::End(0)).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the bytes of rows in memory, and in the file.
    fn bytes(spool: &Spool) -> (usize, u64) {
        (spool.rows.buffer().len(), spool.rows.get_ref().metadata().expect("a file").len())
    }

    #[test]
    fn memory_does_not_grow_with_the_rows() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let mut spool = Spool::new(folder.path(), 40).expect("a spool");
        let rows = 100 * BUFFER / (4 * 40);
        for row in 0..rows {
            spool.push(&[row as f32; 40]).expect("written");
            let (memory, disk) = bytes(&spool);
            assert!(memory <= BUFFER && memory as u64 + disk == 4 * 40 * (row as u64 + 1), "{memory} and {disk}");
        }
        assert_eq!(spool.rows.capacity(), BUFFER);
        assert_eq!(folder.path().read_dir().expect("a folder").count(), 0, "a killed process leaves nothing");
    }

    #[test]
    fn rows_append_after_a_write() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let mut spool = Spool::new(folder.path(), 1).expect("a spool");
        let mut values = |row: f32, lengths: &[usize]| {
            spool.push(&[row]).expect("written");
            let mut npy = Vec::new();
            spool.write_npy(lengths, &mut npy).expect("all rows");
            let header = npy_header("<f4", &[lengths.len(), lengths.iter().copied().max().unwrap_or(0), 1]);
            assert!(npy.starts_with(&header));
            npy[header.len()..].chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<_>>()
        };
        assert_eq!(values(1.0, &[1]), [1.0]);
        assert_eq!(values(2.0, &[1, 1]), [1.0, 2.0]);
        assert_eq!(values(3.0, &[1, 2]), [1.0, 0.0, 2.0, 3.0]);
        assert!(spool.write_npy(&[4], &mut Vec::new()).is_err(), "there are three rows");
    }
}
