//! Recorded episodes and their file.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use actq::data::{CRC32, NpzWriter, longest_piece};
use anyhow::Result;

use super::spool::Spool;

/// Episodes in order, with their values on disk. Only the last may be empty.
#[derive(Debug)]
pub(super) struct Episodes {
    /// `true` if steps depend on each other, so that no episode may be split.
    recurrent: bool,
    /// Observations, and actions if they are recorded.
    arrays: Vec<(&'static str, Spool)>,
    lengths: Vec<usize>,
    longest: usize,
}

impl Episodes {
    /// Creates a list with one empty episode. `obs` and `action` are the values of a row, with `action` 0 for no
    /// actions; the values go to the disk of `folder`.
    pub(super) fn new(folder: &Path, obs: usize, action: usize, recurrent: bool) -> io::Result<Self> {
        let recorded = [("obs", obs), ("action", action)].into_iter().filter(|(_, width)| *width > 0);
        let arrays = recorded.map(|(name, width)| Ok((name, Spool::new(folder, width)?))).collect::<io::Result<_>>()?;
        Ok(Self { recurrent, arrays, lengths: vec![0], longest: 0 })
    }

    /// Begins an episode, unless the last one is empty.
    pub(super) fn begin(&mut self) {
        if self.lengths.last() != Some(&0) {
            self.lengths.push(0);
        }
    }

    /// Adds a step to the last episode.
    pub(super) fn push(&mut self, obs: &[f32], action: &[f32]) -> io::Result<()> {
        for ((_, spool), row) in self.arrays.iter_mut().zip([obs, action]) {
            spool.push(row)?;
        }
        if let Some(length) = self.lengths.last_mut() {
            *length += 1;
            self.longest = self.longest.max(*length);
        }
        Ok(())
    }

    pub(super) fn frames(&self) -> usize {
        self.lengths.iter().sum()
    }

    /// Returns the most bytes of the file's arrays after one more step, with padding.
    pub(super) fn bytes_with_next(&self) -> usize {
        let padded = self.lengths.len().saturating_mul(self.longest + 1);
        let rows = if self.recurrent { padded } else { padded.min(3 * (self.frames() + 1)) };
        let width: usize = self.arrays.iter().map(|(_, spool)| spool.width()).sum();
        rows.saturating_mul(4 * width)
    }

    /// Writes the recording as an .npz archive; `crc` is the checksum of the image. Compression would take longer than
    /// the policy, so the archive is not compressed.
    pub(super) fn write_npz(&mut self, crc: u32, to: &mut File) -> Result<()> {
        let pieces = self.pieces();
        let mut npz = NpzWriter::new(BufWriter::new(to));
        for (name, spool) in &mut self.arrays {
            spool.write_npy(&pieces, npz.begin(name)?)?;
        }
        npz.array("length", &[pieces.len()], pieces.iter().map(|&n| n as i64))?;
        npz.array(CRC32, &[1], [i64::from(crc)])?;
        npz.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?;
        Ok(())
    }

    /// Returns the lengths of the file's episodes. For a feed-forward policy, long episodes are split to save padding.
    fn pieces(&self) -> Vec<usize> {
        let lengths = self.lengths.iter().copied().filter(|n| *n > 0);
        if self.recurrent {
            return lengths.collect();
        }
        let most = longest_piece(self.frames(), lengths.clone().count());
        let cut = |length: usize| (0..length).step_by(most).map(move |at| most.min(length - at));
        lengths.flat_map(cut).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(lengths: &[usize], recurrent: bool) -> Episodes {
        let mut episodes = Episodes::new(&std::env::temp_dir(), 2, 1, recurrent).expect("a temporary file");
        for length in lengths {
            episodes.begin();
            (0..*length).for_each(|i| episodes.push(&[i as f32; 2], &[0.5]).expect("written"));
        }
        episodes
    }

    #[test]
    fn empty_episodes_are_not_written() {
        let mut episodes = recorded(&[3, 0, 0, 2], true);
        episodes.begin();
        episodes.begin();
        assert_eq!((episodes.pieces(), episodes.frames()), (vec![3, 2], 5));
        assert!(recorded(&[], false).pieces().is_empty());
    }

    #[test]
    fn archive_is_not_compressed() {
        let mut file = tempfile::tempfile().expect("a file");
        recorded(&[500, 500], true).write_npz(7, &mut file).expect("written");
        assert!(file.metadata().expect("a size").len() > 4 * 3 * 1000);
    }

    #[test]
    fn splitting_bounds_the_padding() {
        let lengths = [vec![1000], vec![3; 100]].concat();
        let cut = recorded(&lengths, false);
        let pieces = cut.pieces();
        assert_eq!(pieces.iter().sum::<usize>(), 1300);
        assert!(pieces.len() * pieces.iter().max().expect("pieces") <= 3 * 1300, "{pieces:?}");
        assert!(cut.bytes_with_next() <= 4 * 3 * 3 * 1301);
        let whole = recorded(&lengths, true);
        assert_eq!((whole.pieces(), whole.bytes_with_next()), (lengths, 101 * 1001 * 12));
    }
}
