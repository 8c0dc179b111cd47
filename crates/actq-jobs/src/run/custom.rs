//! Jobs whose work the program that runs them has.

use std::path::PathBuf;

use actq::error::Error;

use super::inputs::Kept;
use crate::digest::of_bytes;
use crate::error::JobError;
use crate::figures::{CustomResult, KeptFile};
use crate::host::{Host, Needed};
use crate::job::Job;
use crate::record::Outcome;
use crate::store::Store;
use crate::work::Custom;

/// Does the work of a job of kind custom.
pub(super) fn custom(
    job: &Job,
    work: &Custom,
    store: &Store,
    host: &dyn Host,
    watch: &mut dyn FnMut(&str, f64),
) -> Result<(Outcome, Option<Kept>), JobError> {
    let needs = work.needs.iter().map(|address| needed(address, store)).collect::<Result<Vec<_>, _>>()?;
    let found = host.custom(job, work, &needs, watch)?;
    let (mut file, mut kept) = (None, None);
    if let Some((ending, bytes)) = found.file {
        file = Some(KeptFile { ending: ending.to_owned(), sha256: of_bytes(&bytes) });
        kept = Some(Kept { path: store.file(&job.address, ending), bytes });
    }
    Ok((Outcome::Custom(CustomResult { value: found.value, file }), kept))
}

/// Reads a result that a job needs, and checks the file beside it.
fn needed(address: &str, store: &Store) -> Result<Needed, JobError> {
    let Outcome::Custom(CustomResult { value, file }) = store.read(address)? else {
        return Err(JobError::never(Error::input(format!("{address}: the result is not of kind custom"))));
    };
    let checked = |KeptFile { ending, sha256 }: KeptFile| -> Result<PathBuf, JobError> {
        let path = store.file(address, &ending);
        store.read_blob(&path, &sha256)?;
        Ok(path)
    };
    Ok(Needed { value, file: file.map(checked).transpose()? })
}
