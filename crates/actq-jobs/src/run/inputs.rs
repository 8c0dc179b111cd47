//! Inputs and outputs of a job beside its result.

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Sizes};
use actq::error::{Context as _, Error, Result, ensure};
use actq::runtime::ImageBuffer;

use crate::digest::of_file;
use crate::error::JobError;
use crate::figures::JobResult;
use crate::job::{Input, Job, Role};
use crate::record::Outcome;
use crate::store::Store;

/// A file that is kept beside a result.
pub(super) struct Kept {
    /// Its place.
    pub(super) path: PathBuf,
    /// Its content.
    pub(super) bytes: Vec<u8>,
}

/// Refuses a file that has changed since the plan was made.
pub(super) fn check_inputs(inputs: &[Input]) -> Result<(), JobError> {
    let check = |input: &Input| -> Result<()> {
        let name = input.path.display();
        ensure!(
            of_file(&input.path)? == input.sha256,
            "{name}: has changed since the plan was made; plan again with `actq plan`"
        );
        Ok(())
    };
    Ok(inputs.iter().try_for_each(check)?)
}

/// Returns the path of a policy or folder, which every planned job has.
pub(super) fn path_of(path: Option<&Path>) -> Result<&Path, Error> {
    path.context("the job does not name its policy; plan again")
}

/// Reads an image of the store; the inner error says why there is none.
pub(super) fn image(address: &str, store: &Store) -> Result<Result<(JobResult, ImageBuffer), String>, JobError> {
    match store.read(address)? {
        Outcome::Made(made) => {
            let bytes = store.read_blob(&store.image(address), &made.image)?;
            Ok(Ok((made, ImageBuffer::new(&bytes))))
        }
        Outcome::Impossible(why) => Ok(Err(why)),
        _ => Err(JobError::never(Error::input(format!("{address}: the result is not an image")))),
    }
}

/// Reads the recording that errors are measured on.
pub(super) fn heldout(job: &Job, sizes: Sizes) -> Result<Dataset> {
    let input = job.inputs.iter().find(|input| input.role == Role::Heldout);
    Dataset::load(&input.context("the job has no held-out recording")?.path, sizes)
}
