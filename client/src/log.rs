//! Log of the observations sent and the actions received, as arrays.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::time::Instant;

use anyhow::{Result, ensure};
use ndarray::{Array1, Array2};
use ndarray_npy::NpzWriter;

/// An observation and its action, if one was received.
struct Row {
    sent: f64,
    observation: Vec<f32>,
    answer: Option<Answer>,
}

struct Answer {
    received_at: f64,
    applied: bool,
    action: Vec<f32>,
}

/// A log of observations and actions.
pub struct Log {
    begun: Instant,
    rows: Vec<Row>,
    /// Rows by their observation's sequence number.
    numbers: BTreeMap<u32, usize>,
}

impl Default for Log {
    fn default() -> Self {
        Self { begun: Instant::now(), rows: Vec::new(), numbers: BTreeMap::new() }
    }
}

impl Log {
    /// Records an observation with its frame's sequence number.
    pub fn observed(&mut self, number: u32, observation: &[f32]) {
        self.numbers.insert(number, self.rows.len());
        let sent = self.begun.elapsed().as_secs_f64();
        self.rows.push(Row { sent, observation: observation.to_vec(), answer: None });
    }

    /// Records the action for an observation; ignores one for an unknown observation.
    pub fn acted(&mut self, of: u32, applied: bool, action: Vec<f32>) {
        let received_at = self.begun.elapsed().as_secs_f64();
        if let Some(row) = self.numbers.get(&of).and_then(|row| self.rows.get_mut(*row)) {
            row.answer.get_or_insert(Answer { received_at, applied, action });
        }
    }

    /// Returns the number of observations.
    pub fn observations(&self) -> usize {
        self.rows.len()
    }

    /// Returns the seconds from each answered observation to its action, in order.
    pub fn latencies(&self) -> Vec<f64> {
        self.rows.iter().filter_map(|row| Some(row.answer.as_ref()?.received_at - row.sent)).collect()
    }

    /// Returns an .npz file with the arrays `obs` and `action` (one frame a row; NaN for a missing action), `applied`
    /// (0 or 1), and `sent` and `received` (seconds since the log began; NaN for a missing action).
    ///
    /// # Errors
    ///
    /// Fails if actions differ in length.
    pub fn npz(&self) -> Result<Vec<u8>> {
        let observation_len = self.rows.first().map_or(0, |row| row.observation.len());
        let answers = || self.rows.iter().map(|row| row.answer.as_ref());
        let action_len = answers().flatten().map(|answer| answer.action.len()).next().unwrap_or(0);
        ensure!(
            answers().flatten().all(|answer| answer.action.len() == action_len),
            "the controller's actions have different lengths"
        );
        let observations = self.rows.iter().flat_map(|row| row.observation.iter().copied()).collect();
        let missing = vec![f32::NAN; action_len];
        let actions = answers().flat_map(|a| a.map_or(&missing, |a| &a.action).iter().copied()).collect();
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.add_array("obs", &Array2::from_shape_vec((self.rows.len(), observation_len), observations)?)?;
        npz.add_array("action", &Array2::from_shape_vec((self.rows.len(), action_len), actions)?)?;
        npz.add_array("applied", &Array1::from_iter(answers().map(|a| u8::from(a.is_some_and(|a| a.applied)))))?;
        npz.add_array("sent", &Array1::from_iter(self.rows.iter().map(|row| row.sent)))?;
        npz.add_array("received", &Array1::from_iter(answers().map(|a| a.map_or(f64::NAN, |a| a.received_at))))?;
        Ok(npz.finish()?.into_inner())
    }
}
