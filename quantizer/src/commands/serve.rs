//! `actq serve`

use std::io;
use std::path::Path;

use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_kernels::Image;
use anyhow::{Result, ensure};

use crate::args::ServeArgs;
use crate::importers::load;
use crate::serve::{RecordPlan, serve, serve_recorded};
use crate::terminal::note;

/// Serves an image, and records what it is shown where that was asked for.
pub(crate) fn run(args: &ServeArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let (input, output) = (io::stdin().lock(), io::stdout().lock());
    let Some(path) = &args.record else { return serve(image, input, output, |_| {}) };
    let source = source(args, &image)?;
    if source.is_none() {
        note(["the policy that the image was made from is not in the image's folder: what is recorded gets no array \
               \"action\" (quantize and eval let the policy give it); --policy names its folder"
            .to_owned()]);
    }
    let plan = RecordPlan { path, source: source.as_ref() };
    serve_recorded(image, plan, input, output, |text| note([text]))
}

/// The policy that the image was made from.
fn source(args: &ServeArgs, image: &Image<'_>) -> Result<Option<Policy>> {
    let made_it = |policy: &Policy| policy.digest == image.digest();
    let Some(dir) = &args.policy else {
        let folder = args.image.parent().filter(|folder| !folder.as_os_str().is_empty());
        return Ok(load(folder.unwrap_or(Path::new("."))).ok().filter(made_it));
    };
    let policy = load(dir)?;
    ensure!(
        made_it(&policy),
        "{}: not the policy that {} was made from; name that one's folder (--policy, or ACTQ_POLICY in the environment)",
        dir.display(),
        args.image.display()
    );
    Ok(Some(policy))
}
