//! A clock as a table with one row a tick.

use actq::error::{Result, bail};

use crate::clock::Phases;
use crate::description::{Clock, When};

/// Most rows of a table.
const MAX_ROWS: usize = 4096;
/// Phases that wrap are the same if they differ by less than this share of the interval: their sums in f64 never are.
const SAME: f64 = 1e-9;

/// Rows of phases.
pub(super) struct Rows {
    pub(super) rows: Vec<Vec<f64>>,
    /// Row of the first tick.
    pub(super) first: usize,
    /// Row after the last.
    pub(super) next: usize,
}

/// Runs a clock until its phases repeat. Row 0 is its start.
///
/// # Errors
///
/// If they do not repeat within 4096 ticks.
pub(super) fn rows(clock: &Clock) -> Result<Rows> {
    let moving = Clock { standing: None, when: When::After, ..clock.clone() };
    let mut phases = Phases::new(moving);
    let span = clock.wrap.map_or(0.0, |[low, high]| SAME * (high - low));
    // A phase that restarts above a number does so at the tick of the exact sum.
    let tolerance = if clock.restart_above.is_some() { 0.0 } else { span };
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let next = loop {
        let row = phases.step(&[]);
        let same = |other: &Vec<f64>| other.iter().zip(&row).all(|(a, b)| (a - b).abs() <= tolerance);
        if let Some(known) = rows.iter().position(same) {
            break known;
        }
        if rows.len() == MAX_ROWS {
            bail!("its phases do not repeat within {MAX_ROWS} ticks, the most that an image keeps");
        }
        rows.push(row);
    };
    let first = match clock.when {
        When::After => 0,
        When::Before if rows.len() == 1 => next,
        When::Before => 1,
    };
    Ok(Rows { rows, first, next })
}
