//! `actq serve`

use std::path::Path;
use std::{env, io};

use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_kernels::Image;
use anyhow::{Result, ensure};

use crate::args::ServeArgs;
use crate::ending::Input;
use crate::importers::load;
use crate::serve::{RecordPlan, serve, serve_recorded};
use crate::terminal::note;

/// Serves an image, and records its observations with `--record`.
pub(crate) fn run(args: &ServeArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let output = io::stdout().lock();
    ensure!(
        args.late == 0 || image.chunk() == 1 || image.keeps_rest(),
        "--late: {} keeps no rest of a chunk while the next one is computed; give its policy.json an overlap (docs/POLICY.md)",
        args.image.display()
    );
    // The variable is set for every command of a rollout.
    let is_option =
        args.policy.as_ref().is_some_and(|policy| env::var_os("ACTQ_POLICY").is_none_or(|of| of != **policy));
    let Some(path) = &args.record else {
        ensure!(!is_option, "--policy labels the recording of --record FILE.npz; add that, or remove --policy");
        return serve(image, args.late, io::stdin().lock(), output, |_| {});
    };
    ensure!(
        !is_option || !image.has_around(),
        "--policy labels recordings, but {} takes raw inputs, whose recordings have no labels; remove --policy",
        args.image.display()
    );
    // An action of raw values has no label: `actq quantize` makes the networks' observations of them. Neither has one
    // from noise: whoever reads the recording draws noise, and labels the observations with it.
    let is_labelled = !image.has_around() && image.noise_len() == 0;
    let source = if image.has_around() { None } else { source(args, &image)? };
    if source.is_none() && is_labelled {
        note([
            "the image's folder does not hold the policy that the image was made from, so the recording gets no array \
               \"action\" (quantize and eval then compute it); pass the policy folder to --policy"
                .to_owned(),
        ]);
    }
    let plan = RecordPlan { path, source: source.as_ref().filter(|_| is_labelled) };
    // A signal ends the input, and the recording is written.
    let mut input = Input::stdin();
    serve_recorded(image, plan, &mut input, output, |text| note([text]))
}

/// Loads the policy that the image was made from.
fn source(args: &ServeArgs, image: &Image<'_>) -> Result<Option<Policy>> {
    let made_it = |policy: &Policy| policy.digest == image.digest();
    let Some(dir) = &args.policy else {
        let folder = args.image.parent().filter(|folder| !folder.as_os_str().is_empty());
        return Ok(load(folder.unwrap_or(Path::new("."))).ok().filter(made_it));
    };
    let policy = load(dir)?;
    ensure!(
        made_it(&policy),
        "{}: {} was made from another policy; pass that policy's folder (--policy, or ACTQ_POLICY in the environment)",
        dir.display(),
        args.image.display()
    );
    Ok(Some(policy))
}
