//! `actq export-c`

use std::path::{Path, PathBuf};

use actq::data::{Dataset, Sizes};
use actq::runtime::{ImageBuffer, refuse_prefix, with_head};
use actq_kernels::Image;
use anyhow::{Result, ensure};

use crate::args::ExportCArgs;
use crate::outputs::files::refuse_unlike;
use crate::outputs::unfinished::OutputFolder;
use crate::report::export::{Files, Golden, files};
use crate::terminal::{print, reserve};

/// Writes an image as source code of C.
pub(crate) fn run(args: &ExportCArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let golden = args.golden.as_deref().map(|recording| (recording, args.steps.get()));
    let files = texts(image, buffer.bytes(), &args.out, &args.name, golden)?;
    let inputs: Vec<&Path> = [Some(&*args.image), args.golden.as_deref()].into_iter().flatten().collect();
    let paths = write(&files, &args.out, &inputs, args.force)?;
    let list: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    print(&format!("{}\n", list.join("\n")))
}

/// Returns the source code of C of an image of these `bytes`, for [`write()`] into `folder`. `golden` is a recording, and
/// the most steps of it to run.
///
/// # Errors
///
/// If the name is no identifier of C, if the recording cannot be run, or if the folder has the golden run of an earlier
/// export and `golden` is `None`.
pub fn texts(
    image: Image<'_>,
    bytes: &[u8],
    folder: &Path,
    name: &str,
    golden: Option<(&Path, usize)>,
) -> Result<Files> {
    let is_identifier = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    ensure!(is_identifier, "--name {name:?}: use lower-case letters, digits and underscores, a letter first");
    ensure!(name != "actq", "--name actq: {name}.h is the library's header; choose another name");
    let run = golden.map(|(recording, steps)| replay(image, recording, steps)).transpose()?;
    let stale = folder.join(format!("{name}_golden.c"));
    ensure!(
        run.is_some() || !stale.exists(),
        "{}: it is of an earlier export; remove it, or pass --golden",
        stale.display()
    );
    files(&image, bytes, name, run.as_ref())
}

/// Writes files into a folder, all or none, and returns their paths. None replaces one of `inputs`; files that were not
/// exported are replaced only with `force`.
pub fn write(files: &Files, folder: &Path, inputs: &[&Path], force: bool) -> Result<Vec<PathBuf>> {
    let _folder = OutputFolder::new(folder)?;
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| folder.join(name)).collect();
    for (path, (_, text)) in paths.iter().zip(files) {
        refuse_unlike(path, text, force)?;
    }
    let outputs = reserve(&paths, inputs)?;
    outputs.write(&files.iter().map(|(_, text)| text).collect::<Vec<_>>())?;
    Ok(paths)
}

/// Runs the image from a reset on the first `steps` observations of a recording's first episode.
fn replay(image: Image<'_>, recording: &Path, steps: usize) -> Result<Golden> {
    refuse_prefix(&image, "a golden run")?;
    let recording = Dataset::load(recording, Sizes::of_image(&image))?;
    let mut golden = Golden { observations: Vec::new(), actions: Vec::new() };
    with_head::<_, anyhow::Error>(image, |head| {
        for row in recording.episode(0).take(steps) {
            // The noise of an iterative head follows the observation; the image makes its own.
            let observation = &row[..image.obs_len()];
            golden.actions.extend(head.step(observation)?.iter().map(|value| value.to_bits()));
            golden.observations.extend(observation);
        }
        Ok(())
    })?;
    ensure!(!golden.actions.is_empty(), "{}: its first episode is empty", recording.name());
    Ok(golden)
}
