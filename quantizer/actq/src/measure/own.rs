//! How far an image's actions are from the f32 policy's where the image itself has led the robot.

use std::path::PathBuf;

use actq_kernels::Image;

use super::eval::{ErrorReport, evaluate, fill_actions};
use crate::data::{Dataset, Sizes, driven_by, joined};
use crate::error::{Result, ensure};
use crate::policy::Policy;

/// The error of `image` on the recordings in `files` of what it was shown itself (`actq serve --record`). Those of
/// another image are refused, those that name none are believed. Where actions are missing, `source` gives them, the
/// policy that the image was made from.
pub fn own_path(image: Image<'_>, files: &[PathBuf], source: Option<&Policy>) -> Result<ErrorReport> {
    let load = |file: &PathBuf| -> Result<Dataset> {
        let name = file.display();
        if let Some(other) = driven_by(file)? {
            let own = image.crc();
            ensure!(
                other == own,
                "{name}: records what another image was shown (crc32 {other:08x}, this one has {own:08x}); drive this one with \
                 actq serve --record"
            );
        }
        let mut dataset = Dataset::load(file, Sizes::of_image(&image))?;
        fill_actions(&mut dataset, source)?;
        Ok(dataset)
    };
    let parts = files.iter().map(load).collect::<Result<Vec<_>>>()?;
    evaluate(image, &joined(&parts, image.state().len)?)
}
