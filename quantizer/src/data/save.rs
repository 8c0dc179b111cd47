//! A recording as a file.

use std::io::Cursor;

use anyhow::Result;
use ndarray::Array1;
use ndarray_npy::NpzWriter;

use super::dataset::Dataset;

impl Dataset {
    /// The recording as an .npz archive, uncompressed.
    pub fn npz(&self) -> Result<Vec<u8>> {
        let mut npz = NpzWriter::new(Cursor::new(Vec::new()));
        npz.add_array("obs", &self.obs)?;
        if let Some(action) = &self.action {
            npz.add_array("action", action)?;
        }
        npz.add_array("length", &self.length.iter().map(|&n| n as i64).collect::<Array1<i64>>())?;
        if let Some(state) = &self.state {
            npz.add_array("state", state)?;
        }
        Ok(npz.finish()?.into_inner())
    }
}
