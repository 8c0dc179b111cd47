//! Errors of an image on the path on which it has controlled the robot itself.

use std::path::PathBuf;

use actq_kernels::Image;

use super::eval::{ErrorReport, evaluate, fill_missing};
use crate::data::{Dataset, Sizes, driven_by, is_link_log, joined};
use crate::error::{Result, ensure};
use crate::policy::Policy;

/// Returns the error of `image` on recordings of its own rollouts, in `files` (`actq serve --record`). Recordings of
/// another image and logs of `actq link stream` are refused; other recordings that name no image are accepted. If
/// actions are missing, `source` gives them: the policy that the image was made from.
pub fn own_path(image: Image<'_>, files: &[PathBuf], source: Option<&Policy>) -> Result<ErrorReport> {
    let load = |file: &PathBuf| -> Result<Dataset> {
        let name = file.display();
        if let Some(other) = driven_by(file)? {
            let own = image.crc();
            ensure!(
                other == own,
                "{name}: is a rollout of another image (crc32 {other:08x}, this one has {own:08x}); record this one with \
                 actq serve --record"
            );
        }
        ensure!(
            !is_link_log(file)?,
            "{name}: is a log of actq link stream, recorded by another controller; record a rollout with actq serve --record"
        );
        let mut dataset = Dataset::load(file, Sizes::of_image(&image))?;
        fill_missing(&mut dataset, source)?;
        Ok(dataset)
    };
    let parts = files.iter().map(load).collect::<Result<Vec<_>>>()?;
    evaluate(image, &joined(&parts, image.state().len)?)
}
