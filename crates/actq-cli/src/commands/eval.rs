//! `actq eval`

use std::path::Path;

use actq::data::{Range, Recording, Sizes, driven_by, files_of};
use actq::measure::size::{Beside, file_bits_per_weight};
use actq::measure::{eval, own};
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq::text::count;
use actq_kernels::Image;
use anyhow::{Context as _, Result, ensure};

use crate::args::EvalArgs;
use crate::importers::{load, source_files};
use crate::report::notes::{activation_share, useless};
use crate::terminal::{Progress, note, print};

/// Runs an image over recordings and prints its error against the f32 policy.
pub(crate) fn run(args: &EvalArgs) -> Result<()> {
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    ensure!(
        !image.has_around(),
        "{}: it takes raw inputs; compare it with a reference by `actq check`",
        args.image.display()
    );
    let policy = args.source.as_deref().or(args.policy.as_deref());
    let driven = files_of(&args.driven)?;
    let _progress = Progress::new(args.quiet, "running the image over the recordings")?;
    let source = policy.map(|dir| source_of(dir, &image)).transpose()?.flatten();
    let (dataset, difference) = eval::heldout_from(policy, args.heldout.as_deref(), source.as_ref(), &image)?;
    note(difference.map(|difference| difference.to_string()));
    let report = eval::evaluate(image, &dataset)?;
    let own = (!driven.is_empty()).then(|| own::own_path(image, &driven, source.as_ref())).transpose()?;
    for file in &driven {
        if driven_by(file)?.is_none() {
            note([format!(
                "{}: the file names no image, so it may be the rollout of another policy; actq serve --record names the image",
                file.display()
            )]);
        }
    }
    match Recording::Calib.load(policy, None, Sizes::of_image(&image)) {
        Ok(calib) => note(calib.and_then(|calib| Range::of(&calib).warning(&dataset))),
        Err(error) => note([format!("cannot check the range of the observations: {error:#}")]),
    }
    note(useless(report.nmse));
    if source.is_none() && useless(report.nmse).is_some() {
        note(["only recorded actions are compared; name the image's policy by --policy to compare with its own"
            .to_owned()]);
    }
    if args.json {
        let mut json = serde_json::to_value(&report)?;
        if let Some(own) = own {
            json.as_object_mut()
                .context("the report is not a JSON object")?
                .insert("own_nmse".to_owned(), own.nmse.into());
        }
        return print(&format!("{json}\n"));
    }
    let own = own.map_or(String::new(), |own| {
        let steps = count(own.steps, "observation");
        format!("own path       {:.3e}   ({steps} from the image's own rollouts)\n", own.nmse)
    });
    print(&format!(
        "observations   {}\n\
         nmse           {:.3e}   (mean squared error / variance, mean over dimensions)\n\
         {own}\
         worst nmse     {:.3e}   (dimension {})\n\
         largest error  {:.4}\n\
         activations    {}\n\
         bits/weight    {:.3}   (weights with their scales; {:.3} of the whole file)\n\
         image          {} bytes   ({} beside the weights)\n",
        report.steps,
        report.nmse,
        report.worst_nmse,
        report.worst_dimension,
        report.max_abs,
        activation_share(&eval::activation_share(image, &dataset, report.nmse)?),
        report.bpw,
        file_bits_per_weight(&image),
        report.bytes,
        Beside::of(&image),
    ))
}

/// Returns the policy of a folder, if the image was made from it. A folder with recordings alone has none.
fn source_of(dir: &Path, image: &Image<'_>) -> Result<Option<Policy>> {
    if !source_files(dir).iter().any(|file| file.exists()) {
        ensure!(dir.exists(), "{}: there is no such folder", dir.display());
        ensure!(dir.is_dir(), "{}: not a folder; name a policy folder, or an .onnx file", dir.display());
        return Ok(None);
    }
    let policy = load(dir)?;
    if policy.digest != image.digest() {
        note([format!(
            "{}: the image was made from another policy; only recorded actions are compared",
            dir.display()
        )]);
        return Ok(None);
    }
    Ok(Some(policy))
}
