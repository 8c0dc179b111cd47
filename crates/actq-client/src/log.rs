//! Log of the observations sent and the actions received.

use std::collections::BTreeMap;
use std::time::Instant;

/// An observation and its action, if one was received.
#[derive(Clone, Debug)]
pub struct Row {
    /// When it was sent, in seconds since the log began.
    pub sent: f64,
    /// The observation.
    pub observation: Vec<f32>,
    /// The action for it.
    pub answer: Option<Answer>,
}

/// A received action.
#[derive(Clone, Debug)]
pub struct Answer {
    /// When it was received, in seconds since the log began.
    pub received_at: f64,
    /// `true` if the controller applied it to its outputs.
    pub applied: bool,
    /// Its values.
    pub action: Vec<f32>,
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

    /// Returns all observations with their actions, in the order of sending.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns the seconds from each answered observation to its action, in order.
    pub fn latencies(&self) -> Vec<f64> {
        self.rows.iter().filter_map(|row| Some(row.answer.as_ref()?.received_at - row.sent)).collect()
    }
}
