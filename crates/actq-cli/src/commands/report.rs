//! `actq report`

use std::fs;
use std::path::{Path, PathBuf};

use actq::data::{Dataset, Recording, Sizes, files_of, joined};
use actq::measure::time::CLOCK;
use actq::measure::{eval, own};
use actq::pipeline::stats::Stats;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_deploy::Raw;
use actq_jobs::record::Outcome;
use actq_jobs::results::MergedPolicy;
use actq_jobs::store::Store;
use actq_kernels::{Image, PortKind};
use anyhow::{Context as _, Result, ensure};
use ndarray::Array3;

use crate::args::ReportArgs;
use crate::importers::{load, policy_files};
use crate::report::page::facts::Facts;
use crate::report::page::parts::PARTS;
use crate::report::page::runs::{self, HeadData, Reference};
use crate::report::page::{Page, Success, Sweep, html, success_of};
use crate::terminal::{Progress, print, reserve};

/// Most MACs of the run that gives the printed error.
const MAX_MACS: usize = 4_000_000_000;

/// Writes the report of an image.
pub(crate) fn run(args: &ReportArgs) -> Result<()> {
    let recordings = files_of(&args.recordings)?;
    let driven = files_of(&args.driven)?;
    let inputs = [&args.image].into_iter().chain(&recordings).chain(&driven).chain(&args.stats).cloned();
    let outputs = reserve([&args.out], inputs.chain(args.policy.iter().flat_map(|dir| policy_files(dir))))?;
    let _progress = Progress::new(args.quiet, "running the image over the recordings")?;
    let buffer = ImageBuffer::read(&args.image)?;
    let image = buffer.image(&args.image)?;
    let policy = args.policy.as_deref().map(|dir| source_of(dir, &image)).transpose()?;
    let stats = args.stats.as_deref().map(|path| Stats::read(path, &image)).transpose()?;
    let (outcomes, driven): (Vec<_>, Vec<_>) =
        driven.into_iter().partition(|file| file.extension().is_some_and(|ending| ending == "json"));
    ensure!(outcomes.len() <= 1, "--driven: more than one .json file; name the one with the outcome of all episodes");
    let success = outcomes.first().map(|file| outcome_of(file)).transpose()?;
    let own = (!driven.is_empty()).then(|| own::own_path(image, &driven, policy.as_ref())).transpose()?;
    let dataset = dataset_of(&image, &recordings, args.policy.as_deref())?;
    let facts = Facts::new(&image, buffer.bytes(), stats.as_ref(), args.clock)?;
    let sweep = args.store.as_deref().map(|store| sweep_of(store, &facts)).transpose()?;
    let page = Page {
        own_path: own.map(|own| (own.nmse, own.steps)),
        success: success.or_else(|| sweep.as_ref().and_then(|sweep| sweep.images.iter().find(|i| i.is_own)?.success)),
        sweep,
        ..page(image, buffer.bytes(), facts, policy.as_ref(), dataset)?
    };
    let html = html(&page)?;
    let (shown, bytes) = (args.out.display(), html.len());
    outputs.write(&[html])?;
    print(&format!("{shown}: the report of {}, {bytes} bytes\n", args.image.display()))
}

/// Makes the report of an image; errors call it `name`. With the policy that it was made from, and recordings or the
/// ones in the policy's folder, it compares both.
///
/// # Errors
///
/// If policy or recordings do not match the image, or it cannot run on them.
pub fn of_image(buffer: &ImageBuffer, name: &Path, policy: Option<&Policy>, files: &[PathBuf]) -> Result<String> {
    let image = buffer.image(name)?;
    let facts = Facts::new(&image, buffer.bytes(), None, CLOCK)?;
    policy.map(|policy| of_policy(policy, &image)).transpose()?;
    let folder = policy.map(|policy| &*policy.dir).filter(|dir| !dir.as_os_str().is_empty());
    let dataset = dataset_of(&image, files, folder)?;
    html(&page(image, buffer.bytes(), facts, policy, dataset)?)
}

fn page(
    image: Image<'_>,
    bytes: &[u8],
    facts: Facts,
    policy: Option<&Policy>,
    mut dataset: Option<Dataset>,
) -> Result<Page> {
    let reference = policy.map(Reference::of).transpose()?;
    let mut nmse = None;
    if let (Some(dataset), Some(policy), false) = (&mut dataset, policy, image.has_around()) {
        let most = (MAX_MACS / runs::macs(&image).max(1)).max(200);
        let mut part = dataset.thinned(most, image.state().len > 0).into_owned();
        eval::fill_actions(&mut part, Some(policy))?;
        nmse = Some((eval::evaluate(image, &part)?.nmse, part.frames()));
    }
    let pair = dataset.as_ref().zip(reference.as_ref());
    let runs = pair.map(|(dataset, reference)| runs::compare(image, reference, dataset, nmse)).transpose()?;
    let head = HeadData::new(image, bytes, dataset.as_ref(), reference.as_ref())?;
    Ok(Page { facts, own_path: None, success: None, sweep: None, runs, head, parts: PARTS })
}

/// Reads the success that a simulator printed.
fn outcome_of(file: &Path) -> Result<Success> {
    let name = || file.display().to_string();
    let text = fs::read_to_string(file).context("cannot read the file").with_context(name)?;
    success_of(&text).with_context(name)
}

/// Reads the policy of a folder; refuses another than that of the image.
fn source_of(dir: &Path, image: &Image<'_>) -> Result<Policy> {
    let policy = load(dir)?;
    of_policy(&policy, image).with_context(|| dir.display().to_string())?;
    Ok(policy)
}

/// Refuses another policy than that of the image.
fn of_policy(policy: &Policy, image: &Image<'_>) -> Result<()> {
    let is_own = policy.digest == image.digest();
    ensure!(is_own, "the image was made from another policy; name that one, or make the image again");
    Ok(())
}

/// Reads the recordings in `files`, or without any the one in a policy's folder.
fn dataset_of(image: &Image<'_>, files: &[PathBuf], folder: Option<&Path>) -> Result<Option<Dataset>> {
    let parts = files.iter().map(|file| recorded(image, file)).collect::<Result<Vec<_>>>()?;
    match &parts[..] {
        [] => Ok(folder.map(|dir| recording_of(dir, image)).transpose()?.flatten()),
        [one] => Ok(Some(one.clone())),
        many => Ok(Some(joined(many, image.state().len)?)),
    }
}

/// Reads the held-out recording of a folder, or else its calibration recording. A bundle's are of the network's values,
/// not of raw ones.
fn recording_of(dir: &Path, image: &Image<'_>) -> Result<Option<Dataset>> {
    if image.has_around() {
        return Ok(None);
    }
    let of = |recording: Recording| recording.load(Some(dir), None, Sizes::of_image(image));
    Ok(match of(Recording::Heldout)? {
        Some(dataset) => Some(dataset),
        None => of(Recording::Calib)?,
    })
}

/// Reads a recording of an image's observations: "obs", or for a bundle an array for each raw input.
fn recorded(image: &Image<'_>, file: &Path) -> Result<Dataset> {
    if !image.has_around() {
        return Ok(Dataset::load(file, Sizes::of_image(image))?);
    }
    let inputs = image.ports().filter(|port| port.kind == PortKind::Input);
    let inputs: Vec<(String, usize)> = inputs.map(|port| (port.name.to_owned(), port.len)).collect();
    let frames = match Raw::read(file).and_then(|raw| raw.frames(&inputs)) {
        Ok(frames) => frames,
        Err(by_name) => {
            let sizes = Sizes { obs: image.obs_len(), noise: 0, out: image.act_len(), state: 0 };
            return Dataset::load(file, sizes).map_err(|_| by_name.into());
        }
    };
    let values: Vec<f32> = frames.iter().flatten().flatten().map(|value| *value as f32).collect();
    let obs =
        Array3::from_shape_vec((1, frames.len(), image.obs_len()), values).context("the raw inputs do not fit")?;
    Ok(Dataset { path: file.to_owned(), obs, action: None, length: vec![frames.len()], state: None })
}

/// Finds the sweep of an image in a store: that with the image's digest, or else one of a policy of its name.
fn sweep_of(folder: &Path, facts: &Facts) -> Result<Sweep> {
    let shown = folder.display();
    let store = Store::open_existing(folder)?;
    let mut found: Vec<(bool, f64, MergedPolicy)> = Vec::new();
    for result in store.all()? {
        let Outcome::Merged(merged) = result else { continue };
        for policy in merged.policies {
            let has_image = policy.images.iter().flat_map(|i| &i.made).any(|made| made.image.image == facts.sha256);
            if has_image || policy.policy == facts.name {
                found.push((has_image, merged.clock_hz, policy));
            }
        }
    }
    found.sort_by_key(|(has_image, ..)| !has_image);
    let (_, clock, policy) = found.first().with_context(|| {
        format!("{shown}: it has no merged result of {}; run its sweep to the end, or leave --store out", facts.name)
    })?;
    Ok(Sweep::new(policy, *clock, &facts.sha256))
}
