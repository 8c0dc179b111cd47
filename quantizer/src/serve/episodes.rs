//! Recorded episodes in memory, and the file that they make.

use std::io::Cursor;

use anyhow::Result;
use ndarray::{Array1, Array3, s};
use ndarray_npy::NpzWriter;

use crate::data::{CRC32, longest_piece};

/// Episodes, one behind the other. Only the last may be empty.
#[derive(Debug)]
pub(super) struct Episodes {
    /// Values of an observation and of its action; no value where no actions are recorded.
    widths: [usize; 2],
    /// Whether steps depend on each other, so that no episode may be cut.
    recurrent: bool,
    values: [Vec<f32>; 2],
    lengths: Vec<usize>,
    longest: usize,
}

impl Episodes {
    pub(super) fn new(obs: usize, action: usize, recurrent: bool) -> Self {
        Self { widths: [obs, action], recurrent, values: Default::default(), lengths: vec![0], longest: 0 }
    }

    /// Begins an episode, unless one has begun that is still empty.
    pub(super) fn begin(&mut self) {
        if self.lengths.last() != Some(&0) {
            self.lengths.push(0);
        }
    }

    /// Adds a step to the last episode.
    pub(super) fn push(&mut self, obs: &[f32], action: &[f32]) {
        for (values, more) in self.values.iter_mut().zip([obs, action]) {
            values.extend_from_slice(more);
        }
        if let Some(length) = self.lengths.last_mut() {
            *length += 1;
            self.longest = self.longest.max(*length);
        }
    }

    pub(super) fn frames(&self) -> usize {
        self.lengths.iter().sum()
    }

    /// Bytes that the file's arrays take at most, padding counted, with one more step.
    pub(super) fn bytes_with_next(&self) -> usize {
        let padded = self.lengths.len().saturating_mul(self.longest + 1);
        let rows = if self.recurrent { padded } else { padded.min(3 * (self.frames() + 1)) };
        rows.saturating_mul(4 * (self.widths[0] + self.widths[1]))
    }

    /// The recording as an .npz archive; `crc` is that of the image that was driven. Nothing is compressed: it would
    /// take longer than the policy itself.
    pub(super) fn npz(&self, crc: u32) -> Result<Vec<u8>> {
        let pieces = self.pieces();
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        for ((name, width), values) in ["obs", "action"].into_iter().zip(self.widths).zip(&self.values) {
            if width > 0 {
                npz.add_array(name, &padded(values, width, &pieces)?)?;
            }
        }
        npz.add_array("length", &pieces.iter().map(|&n| n as i64).collect::<Array1<i64>>())?;
        npz.add_array(CRC32, &Array1::from_elem(1, i64::from(crc)))?;
        Ok(npz.finish()?.into_inner())
    }

    /// The lengths of the file's episodes. To a feed-forward policy it makes no difference where they are cut.
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

/// `[episode, step, value]`, with zeros behind every episode's end.
fn padded(values: &[f32], width: usize, lengths: &[usize]) -> Result<Array3<f32>> {
    let longest = lengths.iter().copied().max().unwrap_or(0);
    let mut array = Array3::zeros((lengths.len(), longest, width));
    let mut rest = values;
    for (episode, &length) in lengths.iter().enumerate() {
        let (own, behind) = rest.split_at(length * width);
        let own = ndarray::ArrayView2::from_shape((length, width), own)?;
        array.slice_mut(s![episode, ..length, ..]).assign(&own);
        rest = behind;
    }
    Ok(array)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(lengths: &[usize], recurrent: bool) -> Episodes {
        let mut episodes = Episodes::new(2, 1, recurrent);
        for length in lengths {
            episodes.begin();
            (0..*length).for_each(|i| episodes.push(&[i as f32; 2], &[0.5]));
        }
        episodes
    }

    #[test]
    fn empty_episodes_are_left_out() {
        let mut episodes = recorded(&[3, 0, 0, 2], true);
        episodes.begin();
        episodes.begin();
        assert_eq!((episodes.pieces(), episodes.frames()), (vec![3, 2], 5));
        assert!(recorded(&[], false).pieces().is_empty());
    }

    #[test]
    fn padding_stays_in_proportion_where_episodes_may_be_cut() {
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
