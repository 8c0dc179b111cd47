//! The log of `actq link stream` as arrays.

use std::io::Cursor;

use actq::data::NpzWriter;
use actq_client::log::Row;
use anyhow::{Result, ensure};

/// Returns an .npz file with the arrays `obs` and `action` (one frame per row; NaN for a missing action), `applied` (0
/// or 1), and `sent` and `received` (seconds since the log began; NaN for a missing action).
pub(super) fn npz(rows: &[Row]) -> Result<Vec<u8>> {
    let observation_len = rows.first().map_or(0, |row| row.observation.len());
    let answers = || rows.iter().map(|row| row.answer.as_ref());
    let action_len = answers().flatten().map(|answer| answer.action.len()).next().unwrap_or(0);
    ensure!(
        answers().flatten().all(|answer| answer.action.len() == action_len),
        "the controller's actions have different lengths"
    );
    let missing = vec![f32::NAN; action_len];
    let actions = answers().flat_map(|a| a.map_or(&missing, |a| &a.action).iter().copied());
    let observations = rows.iter().flat_map(|row| row.observation.iter().copied());
    let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
    npz.array("obs", &[rows.len(), observation_len], observations)?;
    npz.array("action", &[rows.len(), action_len], actions)?;
    npz.array("applied", &[rows.len()], answers().map(|a| u8::from(a.is_some_and(|a| a.applied))))?;
    npz.array("sent", &[rows.len()], rows.iter().map(|row| row.sent))?;
    npz.array("received", &[rows.len()], answers().map(|a| a.map_or(f64::NAN, |a| a.received_at)))?;
    Ok(npz.finish()?.into_inner())
}
