//! Files of tensors in the format safetensors.

use anyhow::{Context, Result};
use safetensors::SafeTensors;

use crate::json;

/// The tensors of a file. Refuses a name that is there twice, of which the crate alone would take the last.
pub(crate) fn open(bytes: &[u8]) -> Result<SafeTensors<'_>> {
    // The header, behind its length; whatever is wrong with that is left to the crate.
    let header = bytes.split_first_chunk().and_then(|(len, rest)| {
        let len = usize::try_from(u64::from_le_bytes(*len)).ok()?;
        rest.get(..len)
    });
    header.map(json::parse).transpose().context("its header")?;
    Ok(SafeTensors::deserialize(bytes)?)
}
